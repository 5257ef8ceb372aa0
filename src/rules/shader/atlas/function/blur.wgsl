// One direction of a blur: the weighted mean of the taps that fall on texels of the same chart (the same w); where none
// weighs anything, the texel as it is (MODEL 6). Of differences to it: what is alike everywhere stays so to the bit.
fn {name}_pass(here: vec2i) -> vec4f {
    let size: vec2i = vec2i({size}, {size});
    let middle: vec4f = {source}_near(here);
    if (middle.w == 0.0) {
        return vec4f(0.0, 0.0, 0.0, 0.0);
    }
{reads}{before}    var sum: vec4f = vec4f(0.0, 0.0, 0.0, 0.0);
    for (var i: i32 = -{reach}; i <= {reach}; i++) {
        let tap: vec2f = {kernel};
        let low: f32 = floor(tap.x);
        let f: f32 = tap.x - low;
        for (var side: i32 = 0; side < {sides}; side++) {
            let texel: vec4f = {source}_near(here + (i32(low) + side) * {axis});
            let share: f32 = select(1.0 - f, f, side == 1);
            let weight: f32 = select(0.0, tap.y * share, texel.w == middle.w);
            sum += weight * vec4f(texel.xyz - middle.xyz, 1.0);
        }
    }
    let weighs: bool = sum.w > 0.0;
    let moved: vec3f = sum.xyz / select(1.0, sum.w, weighs);
    return vec4f(middle.xyz + select(vec3f(0.0), moved, weighs), middle.w);
}
