//! Shares over time as lines: one panel above the other, all on one scale of time.

use std::fmt::Write as _;

use super::colour::Rgb;
use super::html::escape;
use super::picture::{LETTER, Picture};

/// Panels with the same lines.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Timeline {
    /// The names of the lines.
    pub lines: Vec<&'static str>,
    /// The panels, from the top.
    pub panels: Vec<Panel>,
}

/// One panel.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    /// What it shows.
    pub title: String,
    /// How long it lasts in milliseconds.
    pub milliseconds: f64,
    /// The shares of each line, from 0 to 1, at even distances.
    pub shares: Vec<Vec<f64>>,
}

const WIDTH: u32 = 960;
const LEFT: u32 = 48;
const RIGHT: u32 = 16;
const TOP: u32 = 40;
/// Height of a panel's lines, and of it all.
const PLOT: u32 = 120;
const STEP: u32 = PLOT + 56;
/// Points of a line: one each so many pixels.
const PITCH: u32 = 3;
const POINTS: usize = ((WIDTH - LEFT - RIGHT) / PITCH) as usize;

/// The lines' colours, legible on white and on black.
const COLOURS: [Rgb; 6] = [
    [140, 140, 140],
    [63, 111, 181],
    [217, 138, 61],
    [58, 145, 92],
    [176, 72, 120],
    [120, 90, 190],
];
const INK: Rgb = [34, 36, 42];
const GRID: Rgb = [222, 219, 212];

impl Timeline {
    /// The text of an `svg` element, which is a file as well.
    pub fn svg(&self) -> String {
        let height = self.height();
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" role=\"img\" \
             font-size=\"13\" font-family=\"system-ui, sans-serif\" fill=\"currentColor\">\n"
        );
        for (x, name, colour) in self.legend() {
            let (bar, name) = (hex(colour), escape(name));
            let text = x + 17;
            let _ = writeln!(
                svg,
                "<rect x=\"{x}\" y=\"8\" width=\"12\" height=\"12\" fill=\"{bar}\"/>\
                 <text x=\"{text}\" y=\"18\">{name}</text>"
            );
        }
        let scale = self.pixels_per_ms();
        for (panel, top) in self.panels.iter().zip(self.tops()) {
            let (title, bottom) = (escape(&panel.title), top + PLOT);
            let _ = writeln!(svg, "<text x=\"{LEFT}\" y=\"{}\">{title}</text>", top - 8);
            for (y, label) in [(top, "100 %"), (top + PLOT / 2, "50 %"), (bottom, "0")] {
                let (end, right, base) = (LEFT - 6, WIDTH - RIGHT, y + 4);
                let _ = writeln!(
                    svg,
                    "<path d=\"M{LEFT} {y}H{right}\" stroke=\"currentColor\" stroke-opacity=\".15\"/>\
                     <text x=\"{end}\" y=\"{base}\" text-anchor=\"end\" font-size=\"11\">{label}</text>"
                );
            }
            for (x, label) in self.ticks() {
                let base = bottom + 16;
                let _ = writeln!(
                    svg,
                    "<text x=\"{x}\" y=\"{base}\" text-anchor=\"middle\" font-size=\"11\">{label}</text>"
                );
            }
            for (shares, colour) in panel.shares.iter().zip(COLOURS.iter().cycle()) {
                let mut path = String::new();
                for (i, (x, y)) in points(shares, panel.milliseconds * scale, top).enumerate() {
                    let _ = write!(path, "{}{x:.1} {y:.1}", if i == 0 { 'M' } else { 'L' });
                }
                let colour = hex(*colour);
                let _ = writeln!(
                    svg,
                    "<path d=\"{path}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.5\"/>"
                );
            }
        }
        svg + "</svg>"
    }

    /// The same as pixels, on white.
    pub fn picture(&self) -> Picture {
        let mut picture = Picture::new(WIDTH, self.height(), [255; 3]);
        for (x, name, colour) in self.legend() {
            for y in 8..20 {
                picture.line((x, y), (x + 11, y), colour);
            }
            picture.text(x + 17, 10, name, INK);
        }
        let scale = self.pixels_per_ms();
        for (panel, top) in self.panels.iter().zip(self.tops()) {
            picture.text(LEFT, top - 16, &panel.title, INK);
            for (y, label) in [(top, "100"), (top + PLOT / 2, "50"), (top + PLOT, "0")] {
                picture.line((LEFT, y), (WIDTH - RIGHT, y), GRID);
                let width = LETTER * label.len() as u32;
                picture.text(LEFT - 6 - width, y - LETTER / 2, label, INK);
            }
            for (x, label) in self.ticks() {
                let half = LETTER * label.len() as u32 / 2;
                picture.text(x.saturating_sub(half), top + PLOT + 8, &label, INK);
            }
            for (shares, colour) in panel.shares.iter().zip(COLOURS.iter().cycle()) {
                let mut before = None;
                for (x, y) in points(shares, panel.milliseconds * scale, top) {
                    let here = (x.round() as u32, y.round() as u32);
                    picture.line(before.unwrap_or(here), here, *colour);
                    before = Some(here);
                }
            }
        }
        picture
    }

    fn height(&self) -> u32 {
        TOP + STEP * self.panels.len() as u32
    }

    /// Where each panel's lines begin.
    fn tops(&self) -> impl Iterator<Item = u32> + use<> {
        (0..self.panels.len() as u32).map(|i| TOP + 20 + STEP * i)
    }

    fn legend(&self) -> impl Iterator<Item = (u32, &'static str, Rgb)> {
        let mut x = LEFT;
        self.lines.iter().zip(COLOURS.into_iter().cycle()).map(move |(name, colour)| {
            let at = x;
            x += 40 + 8 * name.len() as u32;
            (at, *name, colour)
        })
    }

    fn longest_ms(&self) -> f64 {
        self.panels.iter().map(|panel| panel.milliseconds).fold(0.0, f64::max)
    }

    fn pixels_per_ms(&self) -> f64 {
        let longest = self.longest_ms();
        if longest > 0.0 { f64::from(WIDTH - LEFT - RIGHT) / longest } else { 0.0 }
    }

    /// Where the axis of time is labelled, and how: every 1, 2 or 5 of some power of ten.
    fn ticks(&self) -> Vec<(u32, String)> {
        let longest = self.longest_ms();
        if longest <= 0.0 {
            return Vec::new();
        }
        let power = 10f64.powf((longest / 10.0).log10().floor());
        let every = [1.0, 2.0, 5.0, 10.0].into_iter().map(|n| n * power);
        let every = every.into_iter().find(|every| longest / every <= 10.0).unwrap_or(longest);
        let places = (-every.log10().floor()).max(0.0) as usize;
        let count = (longest / every) as u32;
        let scale = self.pixels_per_ms();
        let at = |i: u32| f64::from(i) * every;
        let label = |i: u32| match i {
            0 => "0 ms".to_owned(),
            i => format!("{:.places$}", at(i)),
        };
        (0..=count).map(|i| (LEFT + (at(i) * scale) as u32, label(i))).collect()
    }
}

/// The points of a line `width` pixels wide: means over even stretches of time.
fn points(shares: &[f64], width: f64, top: u32) -> impl Iterator<Item = (f64, f64)> {
    let wanted = (width / f64::from(PITCH)).clamp(1.0, POINTS as f64) as usize;
    let count = wanted.min(shares.len());
    let stretch = move |i: usize| i * shares.len() / count.max(1);
    (0..count).map(move |i| {
        let stretch = &shares[stretch(i)..stretch(i + 1)];
        let mean = stretch.iter().sum::<f64>() / stretch.len().max(1) as f64;
        let x = f64::from(LEFT) + width * (i as f64 + 0.5) / count as f64;
        (x, f64::from(top) + f64::from(PLOT) * (1.0 - mean.clamp(0.0, 1.0)))
    })
}

fn hex([r, g, b]: Rgb) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn timeline(milliseconds: f64, shares: Vec<f64>) -> Timeline {
        let panel = Panel { title: "a & b".into(), milliseconds, shares: vec![shares] };
        Timeline { lines: vec!["memory bus"], panels: vec![panel] }
    }

    #[test]
    fn lines_stand_where_their_means_are() {
        let top = 100;
        // 0 and 1 by turns: stretches of two have a mean of a half.
        let shares: Vec<f64> = (0..2 * POINTS).map(|i| f64::from(i as u32 % 2)).collect();
        let width = f64::from(WIDTH - LEFT - RIGHT);
        let all: Vec<_> = points(&shares, width, top).collect();
        assert_eq!(all.len(), POINTS);
        assert!(all.iter().all(|(_, y)| *y == f64::from(top + PLOT / 2)));
        assert!(all.windows(2).all(|two| two[0].0 < two[1].0));
        assert!(all[POINTS - 1].0 < f64::from(WIDTH - RIGHT));
        assert_eq!(points(&[], width, top).count(), 0);
        assert_eq!(points(&[2.0], width, top).next().unwrap().1, f64::from(top));
    }

    #[test]
    fn drawings_have_their_legend_their_titles_and_a_scale_of_time() {
        let svg = timeline(1.0755, vec![0.5; 100]).svg();
        assert!(svg.contains("memory bus") && svg.contains("a &amp; b"));
        assert!(svg.contains(">0 ms<") && svg.contains(">0.2<") && svg.contains(">1.0<"), "{svg}");
        assert!(!Timeline::default().svg().contains("NaN"));
        let picture = timeline(1.0, vec![0.5; 100]).picture();
        assert_eq!((picture.width(), picture.height()), (WIDTH, TOP + STEP));
        assert!(picture.pixels().contains(&COLOURS[0]));
    }
}
