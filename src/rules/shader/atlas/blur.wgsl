    // The weighted mean along one axis of the taps that fall on texels of the same chart (the same w); where none weighs
    // anything, the texel as it is (MODEL 6). Of differences to it: what is alike everywhere stays so to the bit.
    for (var i = -{reach}; i <= {reach}; i++) {
        let tap: vec2f = {kernel};
        let low = floor(tap.x);
        let f = tap.x - low;
        for (var side = 0; side < {sides}; side++) {
            let texel = texel_near(here, i32(low) + side);
            let share = select(1.0 - f, f, side == 1);
            sum += select(0.0, tap.y * share, texel.w == middle.w) * vec4f(texel.xyz - middle.xyz, 1.0);
        }
    }
    let weighs = sum.w > 0.0;
    return vec4f(middle.xyz + select(vec3f(0.0), sum.xyz / select(1.0, sum.w, weighs), weighs), middle.w);
}
