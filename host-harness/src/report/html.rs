//! A page of HTML in one file: no scripts, nothing fetched, legible in light and dark.

use std::fmt::Write as _;

use serde::Serialize;

use super::Table;

/// Where the numbers of a figure come from. Each figure says so.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Source {
    /// Counted where it happens; exact and the same on every machine.
    Counted,
    /// Computed by a model of the hardware.
    Modelled,
    /// Worked out from parameters alone.
    Computed,
    /// Taken with a clock on this machine.
    Measured,
    /// A picture whose rays the core traced.
    Traced,
}

/// A page under construction.
#[derive(Debug, Clone)]
pub struct Page {
    title: String,
    body: String,
}

impl Page {
    /// A page with a title and a line below it.
    pub fn new(title: &str, below: &str) -> Self {
        let body =
            format!("<h1>{}</h1>\n<p class=\"below\">{}</p>\n", escape(title), escape(below));
        Self { title: title.to_owned(), body }
    }

    /// Begins a section.
    pub fn section(&mut self, heading: &str) -> &mut Self {
        let _ = writeln!(self.body, "<h2>{}</h2>", escape(heading));
        self
    }

    /// Adds a paragraph.
    pub fn paragraph(&mut self, text: &str) -> &mut Self {
        let _ = writeln!(self.body, "<p>{}</p>", escape(text));
        self
    }

    /// Adds a list.
    pub fn list<S: AsRef<str>>(&mut self, items: impl IntoIterator<Item = S>) -> &mut Self {
        self.body.push_str("<ul>\n");
        for item in items {
            let _ = writeln!(self.body, "<li>{}</li>", escape(item.as_ref()));
        }
        self.body.push_str("</ul>\n");
        self
    }

    /// Adds a figure over the whole width.
    pub fn wide(&mut self, figure: Figure) -> &mut Self {
        self.body.push_str("<div class=\"wide\">\n");
        self.body.push_str(&figure.0);
        self.body.push_str("</div>\n");
        self
    }

    /// Adds figures side by side where there is room.
    pub fn row(&mut self, figures: impl IntoIterator<Item = Figure>) -> &mut Self {
        self.body.push_str("<div class=\"row\">\n");
        for figure in figures {
            self.body.push_str(&figure.0);
        }
        self.body.push_str("</div>\n");
        self
    }

    /// The whole page.
    pub fn finish(&self) -> String {
        format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <title>{}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n{}</body>\n</html>\n",
            escape(&self.title),
            self.body
        )
    }
}

/// A picture, a chart or a table with its caption.
#[derive(Debug, Clone)]
pub struct Figure(String);

impl Figure {
    /// A picture, from the bytes of a PNG file.
    pub fn picture(png: &[u8], caption: &str, source: Source) -> Self {
        let data = base64(png);
        let alt = escape(caption);
        let image = format!("<img src=\"data:image/png;base64,{data}\" alt=\"{alt}\">");
        Self::with_caption(&image, caption, source)
    }

    /// A drawing, from the text of an `svg` element.
    pub fn drawing(svg: &str, caption: &str, source: Source) -> Self {
        Self::with_caption(svg, caption, source)
    }

    /// A table.
    pub fn table(table: &Table, caption: &str, source: Source) -> Self {
        let mut html = String::from("<div class=\"scroll\"><table>\n");
        for (i, row) in table.rows().iter().enumerate() {
            html.push_str("<tr>");
            let tag = if i == 0 { "th" } else { "td" };
            for cell in row {
                let _ = write!(html, "<{tag}>{}</{tag}>", escape(cell));
            }
            html.push_str("</tr>\n");
        }
        html.push_str("</table></div>");
        Self::with_caption(&html, caption, source)
    }

    fn with_caption(content: &str, caption: &str, source: Source) -> Self {
        let (class, word) = match source {
            Source::Counted => ("counted", "counted"),
            Source::Modelled => ("modelled", "modelled"),
            Source::Computed => ("counted", "computed"),
            Source::Measured => ("measured", "measured"),
            Source::Traced => ("counted", "traced"),
        };
        let caption = escape(caption);
        Self(format!(
            "<figure>\n{content}\n<figcaption><span class=\"mark {class}\">{word}</span> {caption}\
             </figcaption>\n</figure>\n"
        ))
    }
}

/// Colours as variables: drawings use them too.
const STYLE: &str = "\
:root { color-scheme: light dark; --paper: #fbfaf7; --ink: #22242a; --faint: #6b6f78;
  --line: #d9d6ce; --card: #ffffff; --a: #3f6fb5; --b: #d98a3d; }
@media (prefers-color-scheme: dark) {
  :root { --paper: #15161a; --ink: #e4e4e6; --faint: #9a9ea8; --line: #34363d; --card: #1d1f24;
    --a: #7da6e0; --b: #e3a765; } }
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 2rem 1.25rem 4rem; max-width: 72rem; background: var(--paper);
  color: var(--ink); font: 16px/1.5 system-ui, sans-serif; }
h1 { margin: 0; font-size: 1.9rem; line-height: 1.2; }
h2 { margin: 2.2rem 0 .6rem; font-size: 1.2rem; }
.wide { margin: .8rem 0; }
ul { max-width: 46rem; margin: .4rem 0; padding-left: 1.2rem; font-size: .92rem; }
p { max-width: 46rem; margin: .4rem 0; }
.below { color: var(--faint); }
.row { display: grid; gap: 1.25rem; grid-template-columns: repeat(auto-fit, minmax(min(100%, 26rem), 1fr));
  align-items: start; }
figure { margin: 0; padding: .9rem; background: var(--card); border: 1px solid var(--line);
  border-radius: .5rem; min-width: 0; }
img, svg { display: block; width: 100%; height: auto; border-radius: .25rem; }
figcaption { margin-top: .6rem; font-size: .88rem; color: var(--faint); }
.mark { padding: .05rem .45rem; border: 1px solid currentColor; border-radius: 1rem; font-size: .75rem;
  color: var(--a); }
.mark.modelled { color: var(--b); }
.mark.measured { color: var(--faint); }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; width: 100%; font-size: .9rem; font-variant-numeric: tabular-nums; }
th, td { padding: .25rem .6rem; border-bottom: 1px solid var(--line); text-align: right;
  white-space: nowrap; }
th:first-child, td:first-child { text-align: left; }
th { font-weight: 600; }
";

/// Text as HTML shows it, in elements and in attributes.
pub(super) fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// Bytes as text, RFC 4648 §4.
fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for three in bytes.chunks(3) {
        let word = three.iter().fold(0u32, |word, byte| word << 8 | u32::from(*byte));
        let word = word << (8 * (3 - three.len()));
        for i in 0..4 {
            let letter = LETTERS[(word >> (18 - 6 * i) & 63) as usize];
            text.push(if i <= three.len() { char::from(letter) } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_has_the_standards_test_vectors() {
        let expect = ["", "Zg==", "Zm8=", "Zm9v", "Zm9vYg==", "Zm9vYmE=", "Zm9vYmFy"];
        for (len, expect) in expect.into_iter().enumerate() {
            assert_eq!(base64(&b"foobar"[..len]), expect);
        }
    }

    #[test]
    fn a_page_is_one_file_with_everything_escaped() {
        let mut page = Page::new("a < b", "\"quoted\" & more");
        let mut table = Table::new(["name", "value"]);
        table.row(["<script>", "1"]);
        page.section("s").row([
            Figure::table(&table, "t", Source::Modelled),
            Figure::picture(b"foo", "p", Source::Traced),
        ]);
        let html = page.finish();
        assert!(
            html.contains("<title>a &lt; b</title>") && html.contains("&quot;quoted&quot; &amp;")
        );
        assert!(html.contains("&lt;script&gt;") && !html.contains("<script"));
        assert!(html.contains("data:image/png;base64,Zm9v\""));
        assert!(html.contains("class=\"mark modelled\">modelled<"));
        assert!(!html.contains("http"), "nothing is fetched");
    }
}
