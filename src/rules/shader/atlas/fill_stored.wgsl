// A texel that is covered; w is 0 for others, also where one was filled before.
fn covered_texel(level: u32, place: vec2i) -> vec4f {
    let texel = level_texel(level, clamp(place, vec2i(0), vec2i(SIZE - 1)));
    return select(vec4f(0.0), vec4f(texel.xyz, 1.0), is_inside(place) && texel.w > 0.0);
}

// The mean of the covered texels among the eight neighbours, and in w how many these are.
fn mean_around(level: u32, here: vec2i) -> vec4f {
    var sum = vec4f(0.0);
    for (var k = 0; k < 9; k++) {
        sum += select(covered_texel(level, here + vec2i(k % 3 - 1, k / 3 - 1)), vec4f(0.0), k == 4);
    }
    return vec4f(sum.xyz / max(sum.w, 1.0), sum.w);
}

// What an empty texel takes: what it shows of another; or that mean, in the second ring of those that the first has filled
// (MODEL 6.5). Below 0 in w: of no chart.
fn filled(level: u32, here: vec2i, shown: vec2i) -> vec4f {
    if (any(shown != here)) {
        return vec4f(level_texel(level, shown).xyz, -1.0);
    }
    let near = mean_around(level, here);
    if (near.w > 0.0) {
        return vec4f(near.xyz, -1.0);
    }
    var sum = vec4f(0.0);
    for (var k = 0; k < 9; k++) {
        let place = here + vec2i(k % 3 - 1, k / 3 - 1);
        if (is_inside(place) && covered_texel(level, place).w == 0.0) {
            let first = mean_around(level, place);
            sum += select(vec4f(0.0), vec4f(first.xyz, 1.0), first.w > 0.0);
        }
    }
    return vec4f(sum.xyz / max(sum.w, 1.0), -1.0);
}

// Column in the low half, row in the high one.
fn unpacked(place: u32) -> vec2i {
    return vec2i(i32(place & 0xffffu), i32(place >> 16u));
}

@compute @workgroup_size(64)
fn cs_main(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) workgroups: vec3u) {
    let i = id.x + 64u * workgroups.x * id.y;
    // The list holds pairs: an empty texel, and the one that it shows; itself where it takes a mean.
    if (2u * i + 1u >= arrayLength(&tiles)) {
        return;
    }
    let here = unpacked(tiles[2u * i]);
    let shown = unpacked(tiles[2u * i + 1u]);
{leaves}}
