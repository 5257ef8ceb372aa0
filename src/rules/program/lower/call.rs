//! Calls of other functions: those that are one instruction, and those that are called in place.

use naga::{Function, Handle};

use super::frame::Frame;
use super::{LowerError, Natives, Value};
use crate::program::graph::{Id, Native, Unary};

impl Frame<'_> {
    pub(super) fn called(
        &mut self,
        callee: Handle<Function>,
        arguments: Vec<Value>,
    ) -> Result<Vec<Id>, LowerError> {
        let called = self.source.natives == Natives::Called;
        match (self.source.module.functions[callee].name.as_deref(), &arguments[..]) {
            (Some("sample_faces"), [Value::Texture(name), _, Value::Numbers(place)]) => {
                let resource = self.graph.resource(name);
                Ok(self.graph.call(Native::Lookup(resource), place.clone(), Vec::new()))
            }
            // The tangent along the place alone; see `tangent::name`.
            (
                Some("sample_faces_ccd"),
                [Value::Texture(name), _, Value::Numbers(place), Value::Numbers(along)],
            ) => {
                let resource = self.graph.resource(name);
                Ok(self.graph.call(Native::Lookup(resource), place.clone(), along[1..].to_vec()))
            }
            (Some("cube_place_of_unit"), [Value::Numbers(direction)]) if called => {
                Ok(self.graph.call(Native::Place, direction.clone(), Vec::new()))
            }
            (Some("cube_place_of_unit_tangent"), [Value::Numbers(direction), Value::Numbers(along)])
                if called =>
            {
                let moved = self.graph.call(Native::Place, direction.clone(), along.clone());
                Ok([vec![self.graph.constant(0.0)], moved].concat())
            }
            (Some("normalize_or"), [Value::Numbers(v), Value::Numbers(fallback)]) if called => {
                Ok(self.graph.call(Native::Unit, [&v[..], fallback].concat(), Vec::new()))
            }
            (
                Some("normalize_or_tangent"),
                [Value::Numbers(v), Value::Numbers(fallback), Value::Numbers(along), Value::Numbers(other)],
            ) if called && other.iter().all(|&id| self.graph.value(id) == Some(0.0)) => {
                Ok(self.graph.call(Native::Unit, [&v[..], fallback].concat(), along.clone()))
            }
            (Some("is_finite"), _) => {
                let numbers = arguments.into_iter().next().and_then(Value::numbers).unwrap_or_default();
                let mut all = self.graph.constant(1.0);
                for number in numbers {
                    let finite = self.graph.unary(Unary::IsFinite, number);
                    all = self.graph.and(all, finite);
                }
                Ok(vec![all])
            }
            _ => self.source.invoke(self.graph, callee, arguments),
        }
    }
}
