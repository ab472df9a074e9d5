"""Reads the SystemRDL source into plain records, which the Rust and Markdown exporters print.

Whatever the exporters cannot express is an error here, so that none of them drops it silently.
"""

from dataclasses import dataclass, field

from peakrdl_regblock.udps import ALL_UDPS
from systemrdl import RDLCompileError, RDLCompiler
from systemrdl.node import AddrmapNode, FieldNode, RegNode
from systemrdl.rdltypes import AccessType, OnWriteType

BUS_BITS = 32

CONSTANT = "Constant"
READ_ONLY = "ReadOnly"
READ_WRITE = "ReadWrite"
WRITE_ONE_TO_CLEAR = "WriteOneToClear"
WRITE_ONE_TO_PULSE = "WriteOneToPulse"


@dataclass
class Value:
    name: str
    number: int
    doc: str


@dataclass
class Enum:
    name: str
    values: list[Value]


@dataclass
class Field:
    name: str
    lsb: int
    width: int
    access: str
    locked: bool
    reset: int | None
    signed: bool
    enum: Enum | None
    doc: str


@dataclass
class Register:
    path: str
    offset: int
    type_name: str
    title: str
    doc: str
    type_doc: str
    group_doc: str
    fields: list[Field] = field(default_factory=list)

    @property
    def reset(self):
        return sum((f.reset or 0) << f.lsb for f in self.fields)

    @property
    def access(self):
        """The kinds of access of the fields, each once, in the order of the bits."""
        return list(dict.fromkeys(f.access for f in self.fields))


@dataclass
class Map:
    name: str
    doc: str
    size: int
    registers: list[Register]
    enums: list[Enum]

    @property
    def types(self):
        """One register of each type; registers of one type have the same fields."""
        chosen = {}
        for register in self.registers:
            other = chosen.setdefault(register.type_name, register)
            if other.fields != register.fields:
                raise SystemExit(f"{register.path}: differs from {other.path}, which has its type")
        return list(chosen.values())


def one_line(text):
    return " ".join((text or "").split())


def read_map(source):
    compiler = RDLCompiler()
    for udp in ALL_UDPS:
        compiler.register_udp(udp)
    try:
        compiler.compile_file(source)
        top = compiler.elaborate().top
    except RDLCompileError:
        raise SystemExit(1) from None  # the compiler has said what and where
    registers = [read_register(node) for node in walk(top)]
    enums = {}
    for register in registers:
        for f in register.fields:
            if f.enum:
                enums.setdefault(f.enum.name, f.enum)
    return Map(top.inst_name, one_line(top.get_property("desc")), top.size, registers, list(enums.values()))


def walk(node):
    for child in node.children(unroll=True):
        if isinstance(child, RegNode):
            yield child
        elif not isinstance(child, FieldNode):
            yield from walk(child)


def read_register(node):
    path = node.get_rel_path(node.owning_addrmap)
    if node.is_array or node.get_property("regwidth") != BUS_BITS:
        raise SystemExit(f"{path}: registers are single and {BUS_BITS} bits wide")
    parent = node.parent
    if isinstance(parent, AddrmapNode) or parent.orig_type_name is None:
        group_doc = ""
    else:
        group_doc = one_line(parent.get_property("desc"))
    # A register may describe itself better than its type does; the type's own words are kept too.
    definition = node.inst.original_def or node.inst
    type_doc = definition.properties["desc"].get_value() if "desc" in definition.properties else None
    return Register(
        path=path,
        offset=node.absolute_address,
        type_name=node.orig_type_name or path.replace(".", "_"),
        title=one_line(node.get_property("name")),
        doc=required(path, node.get_property("desc")),
        type_doc=required(path, type_doc),
        group_doc=group_doc,
        fields=[read_field(f) for f in node.fields()],
    )


def read_field(node):
    path = node.get_rel_path(node.owning_addrmap)
    encode = node.get_property("encode")
    enum = None
    if encode is not None:
        values = [Value(m.name, m.value, required(f"{encode.type_name}.{m.name}", m.rdl_desc)) for m in encode]
        enum = Enum(encode.type_name, values)
    access = read_access(path, node)
    reset = node.get_property("reset")
    return Field(
        name=node.inst_name,
        lsb=node.lsb,
        width=node.width,
        access=access,
        locked=bool(node.get_property("swwel")),
        reset=reset,
        signed=bool(node.get_property("is_signed")),
        enum=enum,
        doc=required(path, node.get_property("desc")),
    )


def read_access(path, node):
    sw = node.get_property("sw")
    if node.get_property("singlepulse") and sw == AccessType.w:
        return WRITE_ONE_TO_PULSE
    if node.get_property("onwrite") == OnWriteType.woclr and sw == AccessType.rw:
        return WRITE_ONE_TO_CLEAR
    if node.get_property("onwrite") is None and node.get_property("onread") is None:
        if sw == AccessType.rw:
            return READ_WRITE
        if sw == AccessType.r:
            return READ_ONLY if node.is_hw_writable else CONSTANT
    raise SystemExit(f"{path}: an access kind that the exporters do not know")


def required(path, doc):
    doc = one_line(doc)
    if not doc:
        raise SystemExit(f"{path}: has no desc")
    return doc
