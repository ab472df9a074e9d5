//! Bar charts as SVG, for pages of HTML: their colours are the page's.

use std::fmt::Write as _;

use super::html::escape;

/// A bar: its name and its parts, in the order of the chart's legend.
#[derive(Debug, Clone, PartialEq)]
pub struct Bar {
    /// What it stands for.
    pub name: String,
    /// The lengths of its parts.
    pub parts: Vec<f64>,
    /// The number written at its end.
    pub label: String,
}

const WIDTH: f64 = 520.0;
const LEFT: f64 = 110.0;
const RIGHT: f64 = 90.0;
const STEP: f64 = 34.0;
const TOP: f64 = 34.0;
/// The page's colours, for the parts of a bar.
const COLOURS: [&str; 2] = ["var(--a)", "var(--b)"];

/// Horizontal bars on one scale from 0; `legend` names the parts.
pub fn bars(legend: &[&str], bars: &[Bar]) -> String {
    let total = |bar: &Bar| bar.parts.iter().sum::<f64>();
    let longest = bars.iter().map(total).fold(0.0, f64::max);
    let scale = if longest > 0.0 { (WIDTH - LEFT - RIGHT) / longest } else { 0.0 };
    let height = TOP + STEP * bars.len() as f64;
    let mut svg = format!(
        "<svg viewBox=\"0 0 {WIDTH} {height}\" role=\"img\" font-size=\"13\" \
         font-family=\"system-ui, sans-serif\" fill=\"currentColor\">\n"
    );
    let mut x = LEFT;
    for (name, colour) in legend.iter().zip(COLOURS.iter().cycle()) {
        let (text, name) = (x + 17.0, escape(name));
        let _ = writeln!(
            svg,
            "<rect x=\"{x}\" y=\"6\" width=\"12\" height=\"12\" fill=\"{colour}\"/>\
             <text x=\"{text}\" y=\"16\">{name}</text>"
        );
        x += 40.0 + 8.0 * name.len() as f64;
    }
    for (i, bar) in bars.iter().enumerate() {
        let y = TOP + STEP * i as f64;
        let middle = y + 16.0;
        let (end, name) = (LEFT - 10.0, escape(&bar.name));
        let _ = writeln!(svg, "<text x=\"{end}\" y=\"{middle}\" text-anchor=\"end\">{name}</text>");
        let mut x = LEFT;
        for (part, colour) in bar.parts.iter().zip(COLOURS.iter().cycle()) {
            let width = part * scale;
            let _ = writeln!(
                svg,
                "<rect x=\"{x:.1}\" y=\"{y}\" width=\"{width:.1}\" height=\"22\" fill=\"{colour}\"/>"
            );
            x += width;
        }
        let (x, label) = (x + 8.0, escape(&bar.label));
        let _ = writeln!(svg, "<text x=\"{x:.1}\" y=\"{middle}\">{label}</text>");
    }
    svg + "</svg>"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_bar_fills_the_chart_and_the_others_are_in_proportion() {
        let bar = |name: &str, parts: [f64; 2]| Bar {
            name: name.into(),
            parts: parts.into(),
            label: "x".into(),
        };
        let svg = bars(&["read", "written"], &[bar("a", [4.0, 4.0]), bar("b & c", [2.0, 0.0])]);
        assert_eq!(svg.matches("width=\"160.0\"").count(), 2);
        assert_eq!(svg.matches("width=\"80.0\"").count(), 1);
        assert!(svg.contains("b &amp; c"));
        assert!(!bars(&[], &[bar("a", [0.0; 2])]).contains("NaN"));
    }
}
