    // As neighbours.wgsl has it.
    let middle = level_texel({source}, here).xyz;
    for (var axis = 0; axis < 2; axis++) {
        let step = select(vec2i(0, 1), vec2i(1, 0), axis == 0);
        var ends = array<vec3f, 2>(middle, middle);
        var found = 0.0;
        for (var side = 0; side < 2; side++) {
            let place = here + (2 * side - 1) * step;
            let texel = level_texel({source}, clamp(place, vec2i(0), vec2i(SIZE - 1)));
            if (is_inside(place) && texel.w == chart) {
                ends[side] = texel.xyz;
                found += 1.0;
            }
        }
        at.apart[axis] = distance(ends[0], ends[1]) / max(found, 1.0);
    }
