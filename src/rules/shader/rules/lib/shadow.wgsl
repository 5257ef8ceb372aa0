// Shadow maps (Williams 1978): what each light sees first. A layer of shadow_maps is what a light sees one way, six for
// one that shines to all sides; greater depths are nearer to the light, and 0 is nothing. shadow_views has seven rows a
// layer: the columns of the matrix to clip space; where the light stands and 1, or the unit vector towards it and 0; a
// texel's width where w is 1, the bias and the radius in texels, and how many layers the light has; how wide it is (of
// parallel light the tangent of half the angle, of a lamp the radius), what depth is of (of parallel light the distance
// between 1 and 0, of a lamp that of 1), how near to a lamp something may stand, and texels along a side.
fn shadow_row(layer: u32, row: u32) -> vec4f {
    return shadow_views[7u * layer + row];
}

// The layer that shows a place: of six, that of the axis along which it lies furthest from the light.
fn shadow_layer(map: f32, place: vec3f) -> u32 {
    let first = u32(map);
    if (shadow_row(first, 5u).w < 6.0) {
        return first;
    }
    let way = place - shadow_row(first, 4u).xyz;
    let size = abs(way);
    if (size.x >= size.y && size.x >= size.z) {
        return first + select(0u, 1u, way.x < 0.0);
    }
    if (size.y >= size.z) {
        return first + select(2u, 3u, way.y < 0.0);
    }
    return first + select(4u, 5u, way.z < 0.0);
}

// A place (with 1) or a direction (with 0) in a layer's clip space.
fn shadow_clip(layer: u32, v: vec4f) -> vec4f {
    let a = shadow_row(layer, 0u) * v.x + shadow_row(layer, 1u) * v.y;
    return a + shadow_row(layer, 2u) * v.z + shadow_row(layer, 3u) * v.w;
}

// Where a place of clip space lies in the map, how deep, and w.
fn shadow_projected(clip: vec4f) -> vec4f {
    return vec4f(0.5 + 0.5 * clip.x / clip.w, 0.5 - 0.5 * clip.y / clip.w, clip.z / clip.w, clip.w);
}

// Where a layer shows a place, how deep it lies there, and w.
fn shadow_seen(layer: u32, place: vec3f) -> vec4f {
    return shadow_projected(shadow_clip(layer, vec4f(place, 1.0)));
}

// Whether a layer shows what was seen; behind a lamp and beside its map there is nothing.
fn shadow_holds(seen: vec4f) -> bool {
    return seen.w > 0.0 && all(abs(seen.xy - 0.5) <= vec2f(0.5));
}

// The share of the four texels around what was seen that hold nothing nearer to the light, by how near they are.
fn shadow_open(layer: u32, seen: vec4f) -> f32 {
    if (!shadow_holds(seen)) {
        return 1.0;
    }
    // A tap may lie below all that is drawn, where there is nothing either.
    return textureSampleCompareLevel(shadow_maps, shadow_sampler, seen.xy, layer, max(seen.z, 0.0));
}

fn shadow_compare(map: f32, place: vec3f) -> f32 {
    let layer = shadow_layer(map, place);
    return shadow_open(layer, shadow_seen(layer, place));
}

// A place moved towards the light, off all that the four texels around it show of its own plane, and a texel's width
// there. On a plane with normal n such a texel shows at most a texel of each of the map's axes times how far n leans along
// it. What is added to that is for rounding, and where light grazes the surface it goes no further than 20 texels.
fn shadow_raised(map: f32, place: vec3f, n: vec3f, toward: vec3f) -> vec4f {
    let layer = shadow_layer(map, place);
    let filter_row = shadow_row(layer, 5u);
    let a = vec3f(shadow_row(layer, 0u).x, shadow_row(layer, 1u).x, shadow_row(layer, 2u).x);
    let b = vec3f(shadow_row(layer, 0u).y, shadow_row(layer, 1u).y, shadow_row(layer, 2u).y);
    let texel = filter_row.x * shadow_seen(layer, place).w;
    let leaning = 0.5 * filter_row.x * shadow_row(layer, 6u).w * (abs(dot(a, n)) + abs(dot(b, n)));
    let lift = filter_row.y * texel * (leaning + 0.05) / max(dot(n, toward), 0.05);
    return vec4f(place + lift * toward, texel);
}

// The tap with number i of the unit disc: points of a spiral that are evenly spread (Vogel 1979).
fn shadow_tap(i: u32) -> vec2f {
    let angle = 2.399963229728653 * f32(i);
    return sqrt((f32(i) + 0.5) / f32(shadow_taps())) * vec2f(cos(angle), sin(angle));
}

// The axes of a disc that faces the light, slid along the light to the plane of the surface.
fn shadow_axes(n: vec3f, toward: vec3f) -> mat2x3f {
    let across = normalize_or(vec3f(toward.z, 0.0, -toward.x), vec3f(1.0, 0.0, 0.0));
    let beside = cross(toward, across);
    let slide = toward / max(dot(n, toward), 0.1);
    return mat2x3f(across - dot(n, across) * slide, beside - dot(n, beside) * slide);
}

// The mean over a disc around a place.
fn shadow_disc(map: f32, place: vec3f, n: vec3f, toward: vec3f, radius: f32) -> f32 {
    let axes = shadow_axes(n, toward);
    let layer = u32(map);
    var sum = 0.0;
    if (shadow_row(layer, 5u).w < 6.0) {
        // One layer holds all taps, and its clip space is linear in them.
        let middle = shadow_clip(layer, vec4f(place, 1.0));
        let across = radius * shadow_clip(layer, vec4f(axes[0], 0.0));
        let beside = radius * shadow_clip(layer, vec4f(axes[1], 0.0));
        for (var i = 0u; i < shadow_taps(); i++) {
            let tap = shadow_tap(i);
            sum += shadow_open(layer, shadow_projected(middle + tap.x * across + tap.y * beside));
        }
    } else {
        for (var i = 0u; i < shadow_taps(); i++) {
            sum += shadow_compare(map, place + radius * (axes * shadow_tap(i)));
        }
    }
    return sum / f32(shadow_taps());
}

// One comparison.
fn shadow_compared(map: f32, place: vec3f, normal: vec3f, toward: vec3f) -> f32 {
    if (map < 0.0) {
        return 1.0;
    }
    return shadow_compare(map, shadow_raised(map, place, normalize_or(normal, toward), toward).xyz);
}

// Comparisons within the map's radius, in texels.
fn shadow_filtered(map: f32, place: vec3f, normal: vec3f, toward: vec3f) -> f32 {
    if (map < 0.0) {
        return 1.0;
    }
    let n = normalize_or(normal, toward);
    let raised = shadow_raised(map, place, n, toward);
    return shadow_disc(map, raised.xyz, n, toward, shadow_row(u32(map), 5u).z * raised.w);
}

// How far from the light a depth lies.
fn shadow_distance(about: vec4f, parallel: bool, depth: f32) -> f32 {
    return select(about.y / max(depth, 1e-30), (1.0 - depth) * about.y, parallel);
}

// The mean distance from the light of what stands before a place, within a radius; none is negative.
fn shadow_blockers(map: f32, place: vec3f, n: vec3f, toward: vec3f, radius: f32) -> f32 {
    let about = shadow_row(u32(map), 6u);
    let parallel = shadow_row(u32(map), 4u).w == 0.0;
    var sum = 0.0;
    var count = 0.0;
    let axes = shadow_axes(n, toward);
    for (var i = 0u; i < shadow_taps(); i++) {
        let tap = place + radius * (axes * shadow_tap(i));
        let layer = shadow_layer(map, tap);
        let seen = shadow_seen(layer, tap);
        if (shadow_holds(seen)) {
            let texel = clamp(vec2i(seen.xy * about.w), vec2i(0), vec2i(i32(about.w) - 1));
            let depth = textureLoad(shadow_maps, texel, layer, 0);
            if (depth > seen.z) {
                sum += shadow_distance(about, parallel, depth);
                count += 1.0;
            }
        }
    }
    return select(-1.0, sum / max(count, 1.0), count > 0.0);
}

// Comparisons within the radius of a penumbra, which widens from the blockers to the place as it does from them to the
// light (Fernando 2005).
fn shadow_softened(map: f32, place: vec3f, normal: vec3f, toward: vec3f) -> f32 {
    if (map < 0.0) {
        return 1.0;
    }
    let about = shadow_row(u32(map), 6u);
    let parallel = shadow_row(u32(map), 4u).w == 0.0;
    let n = normalize_or(normal, toward);
    let raised = shadow_raised(map, place, n, toward);
    let least = shadow_row(u32(map), 5u).z * raised.w;
    if (about.x <= 0.0) {
        return shadow_disc(map, raised.xyz, n, toward, least);
    }
    let depth = shadow_seen(shadow_layer(map, raised.xyz), raised.xyz).z;
    let far = shadow_distance(about, parallel, depth);
    // As wide as the light shows through the nearest place where something may stand, and no wider than a few taps can see.
    let widest = about.x * select((far - about.z) / about.z, far, parallel);
    let search = clamp(widest, least, max(least, 0.25 * far));
    let blocker = shadow_blockers(map, raised.xyz, n, toward, search);
    if (blocker < 0.0) {
        return 1.0;
    }
    let gap = max(far - blocker, 0.0);
    let penumbra = about.x * select(gap / max(blocker, 1e-30), gap, parallel);
    return shadow_disc(map, raised.xyz, n, toward, clamp(penumbra, least, search));
}

// How much further from the light a place lies than what its map shows first, along the light's way: the blend of the four
// texels around it, without those that show nothing. The place is moved into the skin by a texel's
// width, so that where the surface turns away from the light it does not show itself as its own far side.
fn shadow_depth(map: f32, place: vec3f, normal: vec3f) -> f32 {
    if (map < 0.0) {
        return 0.0;
    }
    let own = shadow_layer(map, place);
    let n = normalize_or(normal, vec3f(0.0));
    let sunk = place - shadow_row(own, 5u).x * shadow_seen(own, place).w * n;
    let layer = shadow_layer(map, sunk);
    let seen = shadow_seen(layer, sunk);
    if (!shadow_holds(seen)) {
        return 0.0;
    }
    let about = shadow_row(layer, 6u);
    let light = shadow_row(layer, 4u);
    let parallel = light.w == 0.0;
    let far = shadow_distance(about, parallel, seen.z);
    let at = seen.xy * about.w - 0.5;
    let low = floor(at);
    let share = at - low;
    var sum = 0.0;
    var all = 0.0;
    for (var i = 0u; i < 4u; i++) {
        let corner = vec2f(f32(i & 1u), f32(i >> 1u));
        let texel = clamp(vec2i(low + corner), vec2i(0), vec2i(i32(about.w) - 1));
        let depth = textureLoad(shadow_maps, texel, layer, 0);
        if (depth > 0.0) {
            let weight = abs(1.0 - corner.x - share.x) * abs(1.0 - corner.y - share.y);
            sum += weight * max(far - shadow_distance(about, parallel, depth), 0.0);
            all += weight;
        }
    }
    // A lamp's depth is along its axis: the way is longer, as the place is further than it is deep.
    let slant = select(distance(light.xyz, sunk) / max(far, 1e-30), 1.0, parallel);
    return slant * sum / max(all, 1e-6);
}
