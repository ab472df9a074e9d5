//! The line cache: direct mapped, one miss at a time (`xy_line_cache`).

/// What the cache holds, and the read that is under way.
#[derive(Clone, Debug)]
pub struct LineCache {
    /// Per place, the number of the line that is there.
    lines: Vec<Option<u32>>,
    state: State,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum State {
    Ready,
    /// Asks for this line.
    Ask(u32),
    /// Waits for this line.
    Wait(u32),
}

impl LineCache {
    /// An empty cache of `2^width` lines.
    pub fn new(width: u32) -> Self {
        Self { lines: vec![None; 1 << width], state: State::Ready }
    }

    /// The address of the line that is asked for in this cycle.
    pub fn asked(&self) -> Option<u32> {
        match self.state {
            State::Ask(line) => Some(line << 6),
            _ => None,
        }
    }

    /// Runs a cycle in which the word at `addr` is wanted; returns whether it is taken.
    pub fn tick(&mut self, addr: u32, ready: bool, response: bool) -> bool {
        let line = addr >> 6;
        let place = line as usize % self.lines.len();
        match self.state {
            State::Ready if self.lines[place] == Some(line) => return true,
            State::Ready => self.state = State::Ask(line),
            State::Ask(line) if ready => self.state = State::Wait(line),
            State::Wait(line) if response => {
                self.lines[place] = Some(line);
                self.state = State::Ready;
            }
            State::Ask(_) | State::Wait(_) => {}
        }
        false
    }
}
