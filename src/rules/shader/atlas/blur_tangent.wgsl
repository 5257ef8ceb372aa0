    // How the weighted mean moves: by its texels, as the mean itself is linear in them, and by the taps' places and
    // weights.
    // How the sum moves, and the sum of weights in w.
    var change = vec4f(0.0);
    let moved_here = {moved_here};
    for (var i = -{reach}; i <= {reach}; i++) {
        let tap: vec2f = {kernel};
        let slope: vec2f = {slope};
        let low = floor(tap.x);
        let f = tap.x - low;
        for (var side = 0; side < 2; side++) {
            let texel = texel_near(here, i32(low) + side);
            let near = clamp(here + (i32(low) + side) * {axis}, vec2i(0), size - 1);
            let share = select(1.0 - f, f, side == 1);
            let counts = texel.w == middle.w;
            let weight = select(0.0, tap.y * share, counts);
            let moved = select(0.0, slope.y * share + tap.y * select(-slope.x, slope.x, side == 1), counts);
            sum += weight * vec4f(texel.xyz - middle.xyz, 1.0);
            change += moved * vec4f(texel.xyz - middle.xyz, 1.0) + weight * vec4f({moved} - moved_here, 0.0);
        }
    }
    let weighs = sum.w > 0.0;
    let whole = select(1.0, sum.w, weighs);
    let slope = (change.xyz - change.w * sum.xyz / whole) / whole;
    return vec4f(moved_here + select(vec3f(0.0), slope, weighs), middle.w);
}
