//! Work for a program that contains this one, as Python does: what is said goes to that program, and its streams,
//! signals and process stay its own.

use std::cell::RefCell;

/// What a command says, line by line.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Heard {
    /// What it would print on standard output.
    pub said: Vec<String>,
    /// What it would print on standard error: warnings and advice.
    pub told: Vec<String>,
}

thread_local! {
    /// What was said on this thread, while somebody listens.
    static HEARD: RefCell<Option<Heard>> = const { RefCell::new(None) };
}

/// Do some work of the command line on this thread, and hear what it says. It installs no handler of signals, does not
/// start the process anew, and draws no progress bars.
pub fn contained<T>(work: impl FnOnce() -> T) -> (T, Heard) {
    HEARD.set(Some(Heard::default()));
    let done = work();
    (done, HEARD.take().unwrap_or_default())
}

/// Whether this thread works for a program that contains this one.
pub(crate) fn is_contained() -> bool {
    HEARD.with_borrow(Option::is_some)
}

/// Have the listener hear a line: whether there is one.
pub(crate) fn hear(line: impl FnOnce(&mut Heard)) -> bool {
    HEARD.with_borrow_mut(|heard| heard.as_mut().map(line).is_some())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_said_is_heard_on_this_thread_while_it_works_and_nowhere_else() {
        assert!(!is_contained() && !hear(|_| {}));
        let (elsewhere, heard) = contained(|| {
            assert!(is_contained());
            assert!(hear(|heard| heard.said.push("a line".to_owned())));
            assert!(hear(|heard| heard.told.push("a warning".to_owned())));
            std::thread::spawn(is_contained).join().unwrap()
        });
        assert!(!elsewhere && !is_contained());
        assert_eq!((heard.said.concat(), heard.told.concat()), ("a line".to_owned(), "a warning".to_owned()));
    }
}
