//! Cloth: a still one with exactly axis-aligned parts and one that waves.

use super::super::vec3::Vec3;
use super::soup::Soup;

/// A box that holds every frame of the flag, lowest and highest corner: fit one grid frame to it and
/// the whole animation shares its grid.
pub const FLAG_BOX: [[f32; 3]; 2] = [[0.0, -0.25, -0.375], [1.5, 1.25, 0.375]];

/// A tablecloth: the top in y = 1, one side in x = 1, one in z = 0, and one that hangs in ripples
/// from the edge z = 1.
pub(super) fn tablecloth(cells: u32) -> Soup {
    let mut soup = Soup::default();
    soup.parallelogram(cells, [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]);
    soup.parallelogram(cells, [1.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, -0.5, 0.0]);
    soup.parallelogram(cells, [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, -0.5, 0.0]);
    soup.sheet(cells, |u, v| {
        // No ripple at the edge, full ripples at the hem.
        let ripple = 0.06 * v * wave(4.0 * u);
        [1.0 - u, 1.0 - 0.5 * v, 1.0 + 0.12 * v * v + ripple]
    });
    soup
}

/// Frame `frame` of a flag that is held at x = 0 and waves towards +x; it repeats after 64 frames.
pub(super) fn flag(frame: u32, cells: u32) -> Soup {
    let time = f64::from(frame % 64) / 64.0;
    let mut soup = Soup::default();
    soup.sheet(cells, |u, v| -> Vec3 {
        let swing = 0.22 * u * wave(1.5 * u - time) + 0.08 * u * wave(3.0 * u + v - 2.0 * time);
        let sag = 0.2 * u * u * (1.0 + 0.3 * wave(u + 0.25 - time)) * (1.0 - 0.5 * v);
        [1.5 * u * (1.0 - 0.05 * u), v - sag * 0.8, swing]
    });
    soup
}

/// A smooth wave of period 1 between −1 and 1 that is 0 and rising at 0, of parabolas.
fn wave(turns: f64) -> f64 {
    let phase = 2.0 * (turns - turns.floor());
    if phase < 1.0 {
        4.0 * phase * (1.0 - phase)
    } else {
        let phase = phase - 1.0;
        -4.0 * phase * (1.0 - phase)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_flag_stays_in_its_box_keeps_its_topology_and_repeats() {
        let first = flag(0, 16);
        assert_eq!(first, flag(64, 16));
        assert_ne!(first, flag(1, 16));
        for frame in 0..64 {
            let soup = flag(frame, 16);
            assert_eq!(soup.indices, first.indices);
            for p in &soup.positions {
                let inside = (0..3).all(|i| (FLAG_BOX[0][i]..=FLAG_BOX[1][i]).contains(&p[i]));
                assert!(inside, "frame {frame}: {p:?}");
            }
        }
    }

    #[test]
    fn three_sheets_of_the_tablecloth_are_exactly_axis_aligned() {
        let soup = tablecloth(8);
        let flat = |axis: usize, t: &&[u32; 3]| {
            let at = |i: usize| soup.positions[t[i] as usize][axis];
            at(0) == at(1) && at(1) == at(2)
        };
        for axis in 0..3 {
            assert_eq!(soup.indices.iter().filter(|t| flat(axis, t)).count(), 128, "axis {axis}");
        }
    }

    #[test]
    fn the_wave_is_periodic_and_bounded() {
        assert_eq!([0.0, 0.25, 0.5, 0.75, 1.0, -0.25].map(wave), [0.0, 1.0, 0.0, -1.0, 0.0, -1.0]);
    }
}
