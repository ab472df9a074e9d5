//! Long lines of text.

/// The widest line that is printed, in columns.
const COLUMNS: usize = 100;

/// Breaks lines at spaces so that none exceeds `COLUMNS`; what follows is indented by `hanging`.
pub fn wrap(text: &str, hanging: usize) -> String {
    let mut wrapped = String::with_capacity(text.len() + 16);
    for line in text.lines() {
        if !wrapped.is_empty() {
            wrapped.push('\n');
        }
        if line.chars().count() <= COLUMNS {
            wrapped.push_str(line);
            continue;
        }
        let text = line.trim_start();
        let mut column = line.len() - text.len();
        wrapped.push_str(&line[..column]);
        let mut first = true;
        for word in text.split(' ') {
            let width = word.chars().count();
            if !first && column + 1 + width > COLUMNS {
                wrapped.push('\n');
                wrapped.push_str(&" ".repeat(hanging));
                column = hanging;
            } else if !first {
                wrapped.push(' ');
                column += 1;
            }
            wrapped.push_str(word);
            column += width;
            first = false;
        }
    }
    wrapped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_messages_are_broken_at_spaces_and_lose_nothing() {
        let long = "word ".repeat(60) + &"x".repeat(120);
        let wrapped = wrap(&long, 2);
        assert!(wrapped.lines().filter(|l| !l.contains('x')).all(|l| l.len() <= COLUMNS));
        let words = |text: &str| text.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
        assert_eq!(words(&wrapped), words(&long));
        let item = format!("  item  {}", "word ".repeat(30));
        let lines: Vec<String> = wrap(&item, 8).lines().map(str::to_owned).collect();
        assert!(lines[0].starts_with("  item  word") && lines[1].starts_with("        word"));
        assert_eq!(wrap("error: short\n  list", 2), "error: short\n  list");
    }
}
