{reads}{before}    var sum = vec4f(0.0);
{sums}    for (var i = -{reach}; i <= {reach}; i++) {
        let tap: vec2f = {kernel};
{slopes}        let low = floor(tap.x);
        let f = tap.x - low;
        for (var side = 0; side < {sides}; side++) {
            let place = here + (i32(low) + side) * {axis};
            if (!is_inside(place)) {
                continue;
            }
            let texel = level_texel({source}, place);
            if (texel.w != middle.w) {
                continue;
            }
            let off = vec4f(texel.xyz - middle.xyz, 1.0);
            let share = select(1.0 - f, f, side == 1);
            let weight = tap.y * share;
            sum += weight * off;
{adds}        }
    }
