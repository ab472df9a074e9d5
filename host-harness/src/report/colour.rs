//! Colours: a scale on which equal steps look equal, and the display's encoding.

/// A colour as a display takes it: sRGB, 8 bits a channel.
pub type Rgb = [u8; 3];

/// The colour of `t` in 0 to 1 on the scale of heat maps, from near black over purple, red and orange
/// to pale yellow.
///
/// Lightness rises in equal steps (in Oklab, Ottosson 2020), so that it reads right in grey and to
/// colour-blind eyes too.
pub fn heat(t: f64) -> Rgb {
    let t = if t.is_nan() { 0.0 } else { t.clamp(0.0, 1.0) };
    // Hues in degrees: purple, magenta, red, orange, yellow.
    const HUES: [f64; 5] = [-70.0, -30.0, 25.0, 62.0, 108.0];
    let at = t * (HUES.len() - 1) as f64;
    let below = (at as usize).min(HUES.len() - 2);
    let hue = (HUES[below] + (HUES[below + 1] - HUES[below]) * (at - below as f64)).to_radians();
    let lightness = 0.10 + 0.87 * t;
    // Most colourful in the middle, where the display has most to give; grey at both ends.
    let chroma = 0.40 * t * (1.0 - t) + 0.085 * (1.0 - (2.0 * t - 1.0).powi(4)) + 0.06 * t;
    let shown = |chroma: f64| oklab(lightness, chroma * hue.cos(), chroma * hue.sin());
    let inside = |chroma| shown(chroma).iter().all(|c| (-1e-4..=1.0001).contains(c));
    // Where the display cannot show it, less chroma keeps lightness and hue; grey can be shown.
    let (mut low, mut high) = (0.0, chroma);
    if inside(high) {
        low = high;
    }
    while high - low > 1e-4 {
        let middle = (low + high) / 2.0;
        if inside(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    shown(low).map(encode)
}

/// Oklab to linear light.
fn oklab(l: f64, a: f64, b: f64) -> [f64; 3] {
    let cube = |ka: f64, kb: f64| (l + ka * a + kb * b).powi(3);
    let long = cube(0.396_337_777_4, 0.215_803_757_3);
    let medium = cube(-0.105_561_345_8, -0.063_854_172_8);
    let short = cube(-0.089_484_177_5, -1.291_485_548_0);
    [
        4.076_741_662_1 * long - 3.307_711_591_3 * medium + 0.230_969_929_2 * short,
        -1.268_438_004_6 * long + 2.609_757_401_1 * medium - 0.341_319_396_5 * short,
        -0.004_196_086_3 * long - 0.703_418_614_7 * medium + 1.707_614_701_0 * short,
    ]
}

/// Linear light in 0 to 1 as an sRGB byte; beyond, the nearest.
pub fn encode(light: f64) -> u8 {
    let c = light.clamp(0.0, 1.0);
    let curved = if c <= 0.003_130_8 { 12.92 * c } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 };
    (curved * 255.0).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Relative luminance of an sRGB colour.
    fn luminance(colour: Rgb) -> f64 {
        let linear = colour.map(|c| {
            let c = f64::from(c) / 255.0;
            if c <= 0.040_45 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
        });
        0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
    }

    #[test]
    fn the_heat_scale_grows_lighter_all_the_way() {
        let light: Vec<f64> = (0..=64).map(|i| luminance(heat(f64::from(i) / 64.0))).collect();
        assert!(light.windows(2).all(|pair| pair[0] < pair[1]), "{light:?}");
        assert!(light[0] < 0.01 && light[64] > 0.8, "{light:?}");
    }

    #[test]
    fn what_is_off_the_scale_takes_its_ends() {
        assert_eq!(heat(-1.0), heat(0.0));
        assert_eq!(heat(7.0), heat(1.0));
        assert_eq!(heat(f64::NAN), heat(0.0));
        assert_eq!([-1.0, 0.0, 1.0, 9.0].map(encode), [0, 0, 255, 255]);
    }
}
