//! An operation of burn's autodiff over [`Inputs`], any of which may be tracked.

use std::fmt::Debug;
use std::sync::Arc;

use burn::backend::autodiff::checkpoint::base::Checkpointer;
use burn::backend::autodiff::checkpoint::strategy::NoCheckpointing;
use burn::backend::autodiff::grads::Gradients;
use burn::backend::autodiff::ops::{Backward, Ops, OpsKind};
use burn::backend::wgpu::{CubeBackend, CubeTensor};
use burn::backend::{Autodiff, Shape};
use burn::tensor::Tensor;

use super::inputs::{INPUTS, Input, Inputs, TrackedTensor};
use super::{SharedDevice, TensorError, or_zeros};

/// What an operation is made of: its passes forwards and backwards.
pub(super) trait Operation: Debug + Send + Sync {
    fn shared(&self) -> &SharedDevice;

    /// Whether it reads an input.
    fn reads(&self, input: Input) -> bool;

    /// That there are derivatives by the inputs that are tracked.
    fn check(&self, tracked: &[Input]) -> Result<(), TensorError>;

    /// The shape of an input's tensor.
    fn shape(&self, input: Input) -> Shape;

    fn forward(&self, inputs: &[CubeTensor; INPUTS]) -> Result<CubeTensor, TensorError>;

    /// What each of `wanted` gets of an adjoint of what `forward` yields, in their order.
    fn backward(
        &self,
        inputs: &[CubeTensor; INPUTS],
        adjoint: CubeTensor,
        wanted: &[Input],
    ) -> Result<Vec<CubeTensor>, TensorError>;
}

/// What an operation yields of inputs, differentiable in those that are tracked.
pub(super) fn run(operation: &Arc<dyn Operation>, inputs: Inputs) -> Result<Tensor<2>, TensorError> {
    let tracked = inputs.all_tracked();
    // A backward pass returns nothing: what it could not do has to be said here.
    operation.check(&tracked)?;
    if tracked.is_empty() {
        let found = operation.forward(&inputs.plain()?)?;
        return Ok(Tensor::from_primitive::<CubeBackend>(found));
    }
    let inputs = inputs.tracked()?;
    let nodes = inputs.each_ref().map(TrackedTensor::node);
    let prepared = Adjoints.prepare::<NoCheckpointing>(nodes).compute_bound().stateful();
    let inputs = inputs.map(TrackedTensor::into_primitive);
    let found = operation.forward(&inputs)?;
    let found = match prepared {
        OpsKind::Tracked(ops) => ops.finish((Arc::clone(operation), inputs), found),
        OpsKind::UnTracked(ops) => ops.finish(found),
    };
    Ok(Tensor::from_primitive::<Autodiff<CubeBackend>>(found))
}

/// The backward pass.
#[derive(Debug)]
struct Adjoints;

impl Backward<CubeBackend, INPUTS> for Adjoints {
    type State = (Arc<dyn Operation>, [CubeTensor; INPUTS]);

    fn backward(self, ops: Ops<Self::State, INPUTS>, gradients: &mut Gradients, _: &mut Checkpointer) {
        let adjoint = gradients.consume::<CubeBackend>(&ops.node);
        let (operation, inputs) = ops.state;
        let nodes = || Input::ALL.into_iter().zip(&ops.parents);
        let tracked = nodes().filter(|(input, node)| node.is_some() && operation.reads(*input));
        let wanted: Vec<Input> = tracked.map(|(input, _)| input).collect();
        let shapes = wanted.iter().map(|&input| operation.shape(input));
        let device = adjoint.device.clone();
        let found = operation.backward(&inputs, adjoint, &wanted);
        for (i, (&input, shape)) in wanted.iter().zip(shapes).enumerate() {
            let one = found.as_ref().map(|all| all[i].clone()).map_err(Clone::clone);
            let gradient = or_zeros(operation.shared().gpu(), one, shape, &device);
            if let Some((_, Some(node))) = nodes().find(|(of, _)| *of == input) {
                gradients.register::<CubeBackend>(node.id, gradient);
            }
        }
    }
}
