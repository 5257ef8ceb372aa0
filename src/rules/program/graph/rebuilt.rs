//! A part of a graph as a graph of its own.

use super::{Call, Graph, Id, Input, Native, Node};

impl Graph {
    /// A graph of what `outputs` are made of, with other inputs in the place of some nodes; and the outputs there.
    #[must_use]
    pub fn rebuilt(&self, outputs: &[Id], instead: impl Fn(Id) -> Option<Input>) -> (Self, Vec<Id>) {
        let mut graph = Self::default();
        let mut moved: Vec<Option<Id>> = vec![None; self.nodes.len()];
        let new =
            |id: Id, graph: &mut Self, moved: &mut Vec<Option<Id>>| self.copy(id, graph, moved, &instead);
        let outputs = outputs.iter().map(|&id| new(id, &mut graph, &mut moved)).collect();
        (graph, outputs)
    }

    /// A node's like in another graph; `moved` tells where what it is made of stands there.
    pub(super) fn copy(
        &self,
        id: Id,
        graph: &mut Self,
        moved: &mut Vec<Option<Id>>,
        instead: &impl Fn(Id) -> Option<Input>,
    ) -> Id {
        if let Some(done) = moved[id.index()] {
            return done;
        }
        let made = if let Some(input) = instead(id) {
            graph.field(&input.name, input.component)
        } else {
            let mut to = |id| self.copy(id, graph, moved, instead);
            match self.node(id) {
                Node::Constant(bits) => graph.constant(f64::from_bits(bits)),
                Node::Field(at) => {
                    let Input { name, component } = &self.fields[at as usize];
                    graph.field(name, *component)
                }
                Node::Uniform(at) => {
                    let Input { name, component } = &self.uniforms[at as usize];
                    graph.uniform(name, *component)
                }
                Node::Unary(op, a) => {
                    let a = to(a);
                    graph.unary(op, a)
                }
                Node::Binary(op, a, b) => {
                    let (a, b) = (to(a), to(b));
                    graph.binary(op, a, b)
                }
                Node::Select { condition, yes, no } => {
                    let (condition, yes, no) = (to(condition), to(yes), to(no));
                    graph.select(condition, yes, no)
                }
                Node::Call(at) => {
                    let Call { native, arguments, along } = &self.calls[at as usize];
                    let (mut copied, mut moved_along) = (Vec::new(), Vec::new());
                    for &id in arguments {
                        copied.push(self.copy(id, graph, moved, instead));
                    }
                    for &id in along {
                        moved_along.push(self.copy(id, graph, moved, instead));
                    }
                    let native = match *native {
                        Native::Lookup(resource) => {
                            Native::Lookup(graph.resource(&self.resources[resource as usize]))
                        }
                        other => other,
                    };
                    graph.add_call(Call { native, arguments: copied, along: moved_along })
                }
                Node::Part(lookup, part) => {
                    let lookup = to(lookup);
                    graph.add(Node::Part(lookup, part))
                }
            }
        };
        moved[id.index()] = Some(made);
        made
    }
}
