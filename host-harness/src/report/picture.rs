//! Pictures: pixels, letters and PNG files.

use font8x8::legacy::BASIC_LEGACY;
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder, ImageError};

use super::colour::Rgb;

/// An image, rows from the top, pixels from the left.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    width: u32,
    height: u32,
    pixels: Vec<Rgb>,
}

/// Height of a letter in pixels; its width is the same.
pub const LETTER: u32 = 8;

impl Picture {
    /// A picture of one colour.
    pub fn new(width: u32, height: u32, colour: Rgb) -> Self {
        Self { width, height, pixels: vec![colour; width as usize * height as usize] }
    }

    /// A picture of the given pixels, row by row; missing ones are black.
    pub fn from_pixels(width: u32, height: u32, mut pixels: Vec<Rgb>) -> Self {
        pixels.resize(width as usize * height as usize, [0; 3]);
        Self { width, height, pixels }
    }

    /// Width in pixels.
    pub const fn width(&self) -> u32 {
        self.width
    }

    /// Height in pixels.
    pub const fn height(&self) -> u32 {
        self.height
    }

    /// All pixels, row by row.
    pub fn pixels(&self) -> &[Rgb] {
        &self.pixels
    }

    /// Sets a pixel; one outside is ignored.
    pub fn set(&mut self, x: u32, y: u32, colour: Rgb) {
        if x < self.width && y < self.height {
            self.pixels[y as usize * self.width as usize + x as usize] = colour;
        }
    }

    /// Draws a line one pixel wide, both ends included.
    pub fn line(&mut self, from: (u32, u32), to: (u32, u32), colour: Rgb) {
        let (dx, dy) = (f64::from(to.0) - f64::from(from.0), f64::from(to.1) - f64::from(from.1));
        let steps = dx.abs().max(dy.abs()).max(1.0);
        for i in 0..=steps as u32 {
            let along = f64::from(i) / steps;
            let x = f64::from(from.0) + dx * along;
            let y = f64::from(from.1) + dy * along;
            self.set(x.round() as u32, y.round() as u32, colour);
        }
    }

    /// The same picture with `rows` more rows of one colour below.
    pub fn extended(mut self, rows: u32, colour: Rgb) -> Self {
        self.height += rows;
        self.pixels.resize(self.width as usize * self.height as usize, colour);
        self
    }

    /// Writes ASCII text; its top left corner is at `(x, y)`.
    pub fn text(&mut self, x: u32, y: u32, text: &str, colour: Rgb) {
        for (i, letter) in text.bytes().enumerate() {
            let glyph = BASIC_LEGACY.get(usize::from(letter)).copied().unwrap_or_default();
            for (row, bits) in (0u32..).zip(glyph) {
                for column in (0..LETTER).filter(|column| bits >> column & 1 == 1) {
                    self.set(x + i as u32 * LETTER + column, y + row, colour);
                }
            }
        }
    }

    /// The bytes of a PNG file.
    ///
    /// # Errors
    /// [`ImageError`], for a picture without pixels or larger than PNG allows.
    pub fn to_png(&self) -> Result<Vec<u8>, ImageError> {
        let mut png = Vec::new();
        let bytes = self.pixels.as_flattened();
        PngEncoder::new(&mut png).write_image(
            bytes,
            self.width,
            self.height,
            ExtendedColorType::Rgb8,
        )?;
        Ok(png)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn png_files_read_back() {
        let mut picture = Picture::new(20, 9, [10, 20, 30]);
        picture.set(3, 2, [255, 0, 1]);
        picture.set(20, 2, [9; 3]);
        let back = image::load_from_memory(&picture.to_png().unwrap()).unwrap().to_rgb8();
        assert_eq!(back.dimensions(), (20, 9));
        assert_eq!(back.get_pixel(3, 2).0, [255, 0, 1]);
        assert_eq!(back.as_raw(), picture.pixels().as_flattened());
    }

    #[test]
    fn lines_join_their_ends_without_gaps() {
        let mut picture = Picture::new(9, 9, [0; 3]);
        picture.line((1, 7), (4, 1), [255; 3]);
        picture.line((8, 8), (8, 8), [255; 3]);
        let lit = |x: u32, y: u32| picture.pixels()[(y * 9 + x) as usize] == [255; 3];
        assert!(lit(1, 7) && lit(4, 1) && lit(8, 8));
        assert!((1..=7).all(|y| (0..8).filter(|&x| lit(x, y)).count() == 1));
    }

    #[test]
    fn letters_are_drawn_upright_and_cut_off_at_the_edge() {
        let mut picture = Picture::new(12, 8, [0; 3]);
        picture.text(0, 0, "LL", [255; 3]);
        let lit = |x: u32, y: u32| picture.pixels()[(y * 12 + x) as usize] == [255; 3];
        let ink = |rows: std::ops::Range<u32>| {
            rows.flat_map(|y| (0..8).map(move |x| (x, y))).filter(|&(x, y)| lit(x, y)).count()
        };
        // An L is heavy at its foot.
        assert!(ink(4..8) > ink(0..4), "{} {}", ink(4..8), ink(0..4));
        assert!(ink(0..8) > 8);
    }
}
