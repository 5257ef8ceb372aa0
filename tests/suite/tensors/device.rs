//! One wgpu device for burn and for us: no copies, and each sees what the other did.

use burn::tensor::Tensor;
use skinfit::gpu::{Choice, Gpu};
use skinfit::tensor::buffer::buffer_of;
use skinfit::tensor::sparse::Entries;
use skinfit::tensor::{Sparse, TensorError};

use super::bench::{matrix, numbers, shared};

#[test]
fn a_tensor_and_its_buffer_are_the_same_memory() {
    let Some(shared) = shared() else { return };
    let tensor = matrix(&[1.0, 2.0, 3.0, 4.0], 2, shared.device());
    let lent = buffer_of(shared.gpu(), tensor.clone()).unwrap();
    let (offset, bytes) = lent.range();
    assert_eq!(bytes, 16);
    // Written through the buffer, read through the tensor: no copy lies between them.
    shared.gpu().write(lent.buffer(), offset + 4, bytemuck::cast_slice(&[7.5_f32]));
    assert_eq!(numbers(tensor.clone()), [1.0, 7.5, 3.0, 4.0]);
    // The same tensor is at the same place however often it is asked for.
    assert_eq!(buffer_of(shared.gpu(), tensor).unwrap().range(), (offset, bytes));
}

#[test]
fn a_view_into_a_tensor_is_lent_as_its_own_numbers() {
    let Some(shared) = shared() else { return };
    let tensor = matrix(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0], 2, shared.device());
    let mut identity = Entries::new(2);
    identity.push_row([(0, 1.0)]);
    identity.push_row([(1, 1.0)]);
    let identity = Sparse::new(shared, &identity).unwrap();
    // The second and third row start in the middle; the transposed first two columns do not even stand together.
    assert_eq!(numbers(identity.apply(tensor.clone().slice([1..3, 0..2])).unwrap()), [3.0, 4.0, 5.0, 6.0]);
    assert_eq!(numbers(identity.apply(tensor.transpose()).unwrap()), [1.0, 3.0, 5.0, 2.0, 4.0, 6.0]);
}

#[test]
fn what_burn_has_queued_is_done_before_our_pass_and_ours_before_what_burn_does_next() {
    let Some(shared) = shared() else { return };
    let mut shift = Entries::new(1000);
    (0..1000).for_each(|row| shift.push_row([((row + 1) % 1000, 1.0)]));
    let shift = Sparse::new(shared, &shift).unwrap();
    let mut want: Vec<f64> = (0..1000).map(f64::from).collect();
    let mut x = matrix(&want, 1, shared.device());
    // Burn's kernels and our passes by turns, nothing waited for: whole numbers below 2^24 are exact.
    for round in 0..20 {
        x = shift.apply(x.add_scalar(f64::from(round))).unwrap().mul_scalar(1.0).sub_scalar(1.0);
        want.iter_mut().for_each(|w| *w += f64::from(round) - 1.0);
        want.rotate_left(1);
    }
    assert_eq!(numbers(x), want.iter().map(|&w| w as f32).collect::<Vec<_>>());
}

#[test]
fn a_tensor_made_by_another_thread_is_whole_when_our_pass_reads_it() {
    let Some(shared) = shared() else { return };
    let mut twice = Entries::new(4);
    (0..4).for_each(|row| twice.push_row([(row, 2.0)]));
    let twice = Sparse::new(shared, &twice).unwrap();
    let made = std::thread::spawn(|| {
        let tensor = matrix(&[1.0, 2.0, 3.0, 4.0], 1, super::bench::shared().unwrap().device());
        // Queued there, and not submitted.
        tensor.add_scalar(1.0)
    });
    assert_eq!(numbers(twice.apply(made.join().unwrap()).unwrap()), [4.0, 6.0, 8.0, 10.0]);
}

#[test]
fn tensors_of_other_shapes_and_devices_are_refused_in_words() {
    let Some(shared) = shared() else { return };
    let mut one = Entries::new(3);
    one.push_row([(2, 1.0)]);
    let one = Sparse::new(shared, &one).unwrap();
    let error = one.apply(Tensor::zeros([2, 1], shared.device())).unwrap_err();
    assert!(matches!(error, TensorError::Shape { .. }), "{error}");
    assert!(error.to_string().contains("[2, 1], not [3, 1]"), "{error}");
}

#[test]
fn a_device_that_is_not_shared_asks_for_what_rendering_uses_alone() {
    let Some(shared) = shared() else { return };
    let choice = Choice { name: Some(shared.gpu().name().to_owned()), ..Choice::default() };
    let own = Gpu::open(&choice).unwrap();
    assert!(own.storage_buffers() <= 8, "a renderer's device has WebGPU's own limits");
    assert!(shared.gpu().storage_buffers() >= own.storage_buffers());
}
