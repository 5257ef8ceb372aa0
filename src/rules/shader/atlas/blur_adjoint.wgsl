    let adjoint = gained(here);
    if (all(adjoint == vec3f(0.0))) {
        return;
    }
    let middle = level_texel({source}, here);
{weigh}    // Where none weighs anything, the texel is as it was (MODEL 6).
    if (!(sum.w > 0.0)) {
        give(here, adjoint);
        return;
    }
    let whole = sum.w;
    let mean = sum.xyz / whole;
    for (var i = -{reach}; i <= {reach}; i++) {
        let tap: vec2f = {kernel};
        let low = floor(tap.x);
        let f = tap.x - low;
        for (var side = 0; side < {sides}; side++) {
            let place = here + (i32(low) + side) * {axis};
            if (!is_inside(place)) {
                continue;
            }
            if (level_texel({source}, place).w != middle.w) {
                continue;
            }
            give(place, tap.y * select(1.0 - f, f, side == 1) / whole * adjoint);
        }
    }
