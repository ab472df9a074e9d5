//! Numbers as people read them.

use std::time::Duration;

/// An integer with commas between thousands: `1,234,567`.
pub fn count(n: u64) -> String {
    let digits = n.to_string();
    let mut text = String::with_capacity(digits.len() * 4 / 3);
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// Bytes in the largest binary unit that leaves at least one: `10.61 MiB`.
pub fn bytes(n: u64) -> String {
    let mut value = n as f64;
    for unit in ["B", "KiB", "MiB", "GiB"] {
        if value < 1024.0 || unit == "GiB" {
            let places = if unit == "B" { 0 } else { 2 };
            return format!("{value:.places$} {unit}");
        }
        value /= 1024.0;
    }
    String::new()
}

/// A rate with a unit prefix: `1.23 M`.
pub fn rate(per_second: f64) -> String {
    match per_second {
        r if r >= 1e9 => format!("{:.2} G", r / 1e9),
        r if r >= 1e6 => format!("{:.2} M", r / 1e6),
        r if r >= 1e3 => format!("{:.1} K", r / 1e3),
        r => format!("{r:.1} "),
    }
}

/// A duration in milliseconds.
pub fn milliseconds(duration: Duration) -> f64 {
    duration.as_secs_f64() * 1e3
}

/// How many of something there are for each of `of`, or `None` if there are none of those.
pub fn ratio(n: u64, of: u64) -> Option<f64> {
    (of > 0).then(|| n as f64 / of as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_well() {
        assert_eq!([0, 999, 1000, 1_234_567].map(count), ["0", "999", "1,000", "1,234,567"]);
        assert_eq!(
            [0, 1023, 1024, 11_129_220].map(bytes),
            ["0 B", "1023 B", "1.00 KiB", "10.61 MiB"]
        );
        assert_eq!(bytes(5 << 40), "5120.00 GiB");
        assert_eq!([12.0, 1.5e3, 2.345e6, 2e9].map(rate), ["12.0 ", "1.5 K", "2.35 M", "2.00 G"]);
        assert_eq!(ratio(3, 0), None);
        assert_eq!(ratio(3, 2), Some(1.5));
    }
}
