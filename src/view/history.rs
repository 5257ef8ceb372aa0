//! Undo and redo: a click is a step, and so is a whole drag.

/// The value that one edits, and those that it had.
#[derive(Clone, Debug)]
pub struct History<T> {
    now: T,
    past: Vec<T>,
    future: Vec<T>,
    /// What it was when the drag that goes on began.
    begun: Option<T>,
}

/// Steps that are kept.
const MOST: usize = 1000;

impl<T: Clone + PartialEq> History<T> {
    /// Of a first value, without a past.
    #[must_use]
    pub const fn new(now: T) -> Self {
        Self { now, past: Vec::new(), future: Vec::new(), begun: None }
    }

    /// The value.
    #[must_use]
    pub const fn now(&self) -> &T {
        &self.now
    }

    /// Change it by a whole step. What leaves it as it is, is none.
    pub fn edit(&mut self, change: impl FnOnce(&mut T)) {
        self.drag(change);
        self.settle();
    }

    /// Change it as part of a step that goes on until [`settle`](Self::settle).
    pub fn drag(&mut self, change: impl FnOnce(&mut T)) {
        let before = self.now.clone();
        change(&mut self.now);
        if self.begun.is_none() && self.now != before {
            self.begun = Some(before);
        }
    }

    /// Change it within the step that it is in, as that led to something else; what leads nowhere is no step.
    pub fn amend(&mut self, change: impl FnOnce(&mut T)) {
        change(&mut self.now);
        if self.past.last() == Some(&self.now) {
            self.past.pop();
        }
    }

    /// The drag is over.
    pub fn settle(&mut self) {
        if let Some(before) = self.begun.take().filter(|before| *before != self.now) {
            self.past.push(before);
            if self.past.len() > MOST {
                self.past.remove(0);
            }
            self.future.clear();
        }
    }

    /// Back by a step, if there is one.
    pub fn undo(&mut self) {
        self.settle();
        if let Some(before) = self.past.pop() {
            self.future.push(std::mem::replace(&mut self.now, before));
        }
    }

    /// Forward again.
    pub fn redo(&mut self) {
        self.settle();
        if let Some(after) = self.future.pop() {
            self.past.push(std::mem::replace(&mut self.now, after));
        }
    }

    /// Take the last step back for good, and those before it that are not `good` either: what it led to cannot be shown.
    pub fn refuse(&mut self, good: impl Fn(&T) -> bool) {
        self.settle();
        while !good(&self.now) {
            let Some(before) = self.past.pop() else { return };
            self.now = before;
        }
        self.future.clear();
    }

    /// Whether there is a step back.
    #[must_use]
    pub fn can_undo(&self) -> bool {
        !self.past.is_empty() || self.begun.as_ref().is_some_and(|before| *before != self.now)
    }

    /// Whether there is one forward.
    #[must_use]
    pub const fn can_redo(&self) -> bool {
        !self.future.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_drag_is_one_step() {
        let mut history = History::new(0);
        (1..=5).for_each(|i| history.drag(|now| *now = i));
        history.settle();
        history.edit(|now| *now = 9);
        history.undo();
        assert_eq!(*history.now(), 5);
        history.undo();
        assert_eq!((*history.now(), history.can_undo()), (0, false));
        history.redo();
        history.redo();
        assert_eq!((*history.now(), history.can_redo()), (9, false));
    }

    #[test]
    fn a_step_that_is_refused_leaves_no_way_back_to_it() {
        let mut history = History::new(1);
        history.edit(|now| *now = 2);
        history.edit(|now| *now = 30);
        history.refuse(|now| *now < 10);
        assert_eq!((*history.now(), history.can_redo()), (2, false));
        history.undo();
        assert_eq!(*history.now(), 1);
    }

    #[test]
    fn a_step_is_amended_and_one_that_leads_nowhere_is_none() {
        let mut history = History::new(1);
        history.edit(|now| *now = 2);
        history.amend(|now| *now = 3);
        history.undo();
        assert_eq!(*history.now(), 1);
        history.redo();
        history.edit(|now| *now = 4);
        history.amend(|now| *now = 3);
        history.undo();
        assert_eq!((*history.now(), history.can_undo()), (1, false));
    }

    #[test]
    fn what_changes_nothing_is_no_step_and_a_change_forgets_what_was_undone() {
        let mut history = History::new(1);
        history.edit(|now| *now = 1);
        assert!(!history.can_undo());
        // There and back again within a drag.
        history.drag(|now| *now = 4);
        history.drag(|now| *now = 1);
        history.settle();
        assert!(!history.can_undo());
        history.edit(|now| *now = 2);
        history.undo();
        history.edit(|now| *now = 3);
        history.redo();
        assert_eq!(*history.now(), 3);
    }
}
