alias Level = texture_2d<f32>;

fn level_size(level: Level) -> vec2i {
    return vec2i(textureDimensions(level));
}

fn level_texel(level: Level, place: vec2i) -> vec4f {
    return textureLoad(level, place, 0);
}

