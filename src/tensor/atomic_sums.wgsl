// Sums of numbers that many threads add to: `largest` is the largest of these, `sums` where they are added up.
//
// Exact sums are whole numbers of 64 bits, in two words: their additions commute, so that the result does not
// depend on the order in which threads come. The unit is a power of two, chosen by the largest number that is to be
// added. Fast sums are floats, exchanged when no other thread was quicker; their last bits vary.

// The exponent of how many units make 1: so that no sum exceeds 62 bits. `headroom` is more than the base-2 logarithm of how
// many numbers a sum may get.
fn unit_exponent(headroom: i32) -> i32 {
    let exponent = i32(atomicLoad(&largest) >> 23u) - 127;
    return clamp(61 - headroom - exponent, -126, 126);
}

fn power_of_two(exponent: i32) -> f32 {
    return bitcast<f32>(u32(exponent + 127) << 23u);
}

fn add_exactly(at: u32, number: f32, units: f32) {
    // Exact: a float has 24 bits, wherever they stand.
    let magnitude = abs(number) * units;
    let above = floor(magnitude * 0x1p-32);
    var low = u32(magnitude - above * 0x1p32);
    var high = u32(above);
    if number < 0.0 {
        low = ~low + 1u;
        high = ~high + select(0u, 1u, low == 0u);
    }
    let before = atomicAdd(&sums[2u * at], low);
    let carry = select(0u, 1u, before + low < before);
    atomicAdd(&sums[2u * at + 1u], high + carry);
}

fn exact_sum(at: u32, headroom: i32) -> f32 {
    var low = atomicLoad(&sums[2u * at]);
    var high = atomicLoad(&sums[2u * at + 1u]);
    let negative = high >= 0x80000000u;
    if negative {
        low = ~low + 1u;
        high = ~high + select(0u, 1u, low == 0u);
    }
    let magnitude = (f32(high) * 0x1p32 + f32(low)) * power_of_two(-unit_exponent(headroom));
    return select(magnitude, -magnitude, negative);
}

fn add_fast(at: u32, number: f32) {
    var old = atomicLoad(&sums[at]);
    loop {
        let exchanged = atomicCompareExchangeWeak(&sums[at], old, bitcast<u32>(bitcast<f32>(old) + number));
        if exchanged.exchanged {
            break;
        }
        old = exchanged.old_value;
    }
}

fn fast_sum(at: u32) -> f32 {
    return bitcast<f32>(atomicLoad(&sums[at]));
}
