// Texels that a lookup counts: two rows of two, and what each weighs.
struct LevelCorners {
    low: vec2i,
    weights: vec4f,
}

// The texels around texture coordinates that are of a chart (w), weighed bilinearly; where none of the four is, the nearest
// one of the chart within four texels (MODEL 6). Without any, nothing.
fn level_corners(level: Level, uv: vec2f, chart: f32) -> LevelCorners {
    let size = level_size(level);
    let at = uv * vec2f(size) - 0.5;
    let low = vec2i(floor(at));
    let f = at - floor(at);
    var weights = vec4f(0.0);
    for (var corner = 0; corner < 4; corner++) {
        let step = vec2i(corner & 1, corner >> 1u);
        let place = low + step;
        let inside = all(place >= vec2i(0)) && all(place < size);
        let own = level_texel(level, clamp(place, vec2i(0), size - 1)).w == chart;
        let share = select(1.0 - f, f, step == vec2i(1));
        weights[corner] = select(0.0, share.x * share.y, inside && own);
    }
    let sum = weights.x + weights.y + weights.z + weights.w;
    if (sum > 0.0) {
        return LevelCorners(low, weights / sum);
    }
    var nearest = low;
    var least = 1e30;
    for (var down = -4; down <= 4; down++) {
        for (var along = -4; along <= 4; along++) {
            let place = vec2i(round(at)) + vec2i(along, down);
            let inside = all(place >= vec2i(0)) && all(place < size);
            let own = level_texel(level, clamp(place, vec2i(0), size - 1)).w == chart;
            let away = vec2f(place) - at;
            if (inside && own && dot(away, away) < least) {
                nearest = place;
                least = dot(away, away);
            }
        }
    }
    return LevelCorners(nearest, vec4f(select(0.0, 1.0, least < 1e30), 0.0, 0.0, 0.0));
}

fn level_at(level: Level, corners: LevelCorners) -> vec4f {
    let most = level_size(level) - 1;
    var sum = vec4f(0.0);
    for (var corner = 0; corner < 4; corner++) {
        let place = corners.low + vec2i(corner & 1, corner >> 1u);
        sum += corners.weights[corner] * level_texel(level, clamp(place, vec2i(0), most));
    }
    return sum;
}
