    let size = vec2i(textureDimensions({source}));
    let middle = textureLoad({source}, here, 0);
{reads}    // From the texel's one neighbour of the same chart to the other, half of it, along u and v; to the one that there is; 0
    // with none (MODEL 6).
    var apart = vec2f(0.0);
    for (var axis = 0; axis < 2; axis++) {
        let step = select(vec2i(0, 1), vec2i(1, 0), axis == 0);
        var ends = array<vec3f, 2>(middle.xyz, middle.xyz);
        var found = 0.0;
        for (var side = 0; side < 2; side++) {
            let place = here + (2 * side - 1) * step;
            let inside = all(place >= vec2i(0)) && all(place < size);
            let texel = textureLoad({source}, clamp(place, vec2i(0), size - 1), 0);
            if (inside && texel.w == middle.w) {
                ends[side] = texel.xyz;
                found += 1.0;
            }
        }
        apart[axis] = distance(ends[0], ends[1]) / max(found, 1.0);
    }
    textureStore(left_0_level, here, {value});
}
