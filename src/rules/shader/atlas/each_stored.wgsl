    let chart = f32(texels[i].y);
    var at: Sample;
