//! The rules' functions evaluated as the f64 reference does: for tests.

use crate::model::real::Real;
use crate::program::graph::Graph;
use crate::program::lower::{Natives, Source, Value};
use crate::program::steps::{Rounding, Steps};

/// A function of numbers.
pub(super) struct Function(Steps);

impl Function {
    /// The function `name` of a text, which takes `count` numbers.
    pub(super) fn new(text: &str, name: &str, count: usize) -> Self {
        let source = Source::new(text, Natives::Written).unwrap();
        let mut graph = Graph::default();
        let mut argument = |at: usize| Value::Numbers(vec![graph.field("x", at)]);
        let arguments = (0..count).map(&mut argument).collect();
        let outputs = source.call(&mut graph, name, arguments).unwrap();
        Self(Steps::new(&graph, &outputs, |_| Rounding::Plain))
    }

    /// Its value.
    pub(super) fn of(&self, numbers: &[f64]) -> Vec<f64> {
        self.run(0.0, numbers)
    }

    /// Its value where all is computed in f32.
    pub(super) fn in_f32(&self, numbers: &[f32]) -> Vec<f32> {
        self.run(0.0, numbers)
    }

    fn run<R: Real>(&self, zero: R, numbers: &[R]) -> Vec<R> {
        let setting = self.0.setting(zero, |_| 0.0, |name| panic!("it looks {name} up"));
        let mut registers = Vec::new();
        self.0.run(&setting, zero, &mut registers, |place| numbers[self.0.fields()[place].component]);
        self.0.outputs(&setting, &registers).collect()
    }
}
