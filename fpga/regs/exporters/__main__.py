"""python exporters XYLEM.RDL RUST_OUT MARKDOWN_OUT"""

import sys
from pathlib import Path

from markdown import print_markdown
from model import read_map
from rust import print_rust

source, rust_out, markdown_out = sys.argv[1:]
register_map = read_map(source)
Path(rust_out).write_text(print_rust(register_map))
Path(markdown_out).write_text(print_markdown(register_map))
