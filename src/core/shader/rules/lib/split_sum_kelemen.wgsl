// The root of what a white furnace does not give back.
fn kelemen_lost(x: f32, y: f32) -> f32 {
    let n0: f32 = 0.46966124 + y * (0.5919148 + y * (0.22342183 + y * (0.037257563 + y * (0.010026506 + y * (0.005592176 + y * 0.001990831)))));
    let n1: f32 = -0.4235378 + y * (-0.17440198 + y * (0.1391108 + y * (0.05283025 + y * (0.012688444 + y * 0.0036649734))));
    let n2: f32 = -0.64266586 + y * (-0.96926224 + y * (-0.3696671 + y * (-0.016365223 + y * 0.002012674)));
    let n3: f32 = 0.6941308 + y * (0.3505067 + y * (-0.11587051 + y * -0.030532705));
    let n4: f32 = 0.113540016 + y * (0.39100316 + y * 0.16732216);
    let n5: f32 = -0.2676194 + y * -0.16305143;
    let n6: f32 = 0.06494488;
    let d0: f32 = 1.0 + y * (1.1465913 + y * (0.32160285 + y * (0.03129975 + y * (0.02496082 + y * (0.00856733 + y * 0.0015117171)))));
    let d1: f32 = -1.3682541 + y * (-1.0242879 + y * (0.06770019 + y * (0.074361585 + y * (-0.008713377 + y * 0.0015109937))));
    let d2: f32 = -0.41004634 + y * (-0.9757293 + y * (-0.50333166 + y * (-0.023397945 + y * 0.01044666)));
    let d3: f32 = 1.1672081 + y * (0.9294726 + y * (0.061528873 + y * -0.03414864));
    let d4: f32 = -0.2793314 + y * (0.060764518 + y * 0.11105847);
    let d5: f32 = -0.13961753 + y * -0.098543465;
    let d6: f32 = 0.04636209;
    return (n0 + x * (n1 + x * (n2 + x * (n3 + x * (n4 + x * (n5 + x * n6)))))) / (d0 + x * (d1 + x * (d2 + x * (d3 + x * (d4 + x * (d5 + x * d6))))));
}

// 1 - H.V' in the mean of its fifth power.
fn kelemen_mean(x: f32, y: f32) -> f32 {
    let n0: f32 = 0.6825832 + y * (0.76223236 + y * (0.3113007 + y * (0.11799382 + y * (0.0053606667 + y * -0.0013436611))));
    let n1: f32 = -0.8376239 + y * (-0.41790307 + y * (0.15741761 + y * (0.01044409 + y * 0.008742448)));
    let n2: f32 = -0.021906504 + y * (-0.3450397 + y * (-0.20516576 + y * -0.036854874));
    let n3: f32 = 0.38872027 + y * (0.22028385 + y * -0.09153923);
    let n4: f32 = -0.20183145 + y * -0.08530459;
    let n5: f32 = 0.02850822;
    let d0: f32 = 1.0 + y * (1.3188906 + y * (0.6244323 + y * (0.21973208 + y * (0.034858666 + y * -0.006648279))));
    let d1: f32 = -0.89064074 + y * (-0.2921717 + y * (0.48723584 + y * (0.1834838 + y * 0.023852749)));
    let d2: f32 = -0.13828073 + y * (-0.4783084 + y * (-0.14406441 + y * 0.041438203));
    let d3: f32 = 0.43263653 + y * (0.25755438 + y * -0.09366973);
    let d4: f32 = -0.20412116 + y * -0.0875524;
    let d5: f32 = 0.028578583;
    return (n0 + x * (n1 + x * (n2 + x * (n3 + x * (n4 + x * n5))))) / (d0 + x * (d1 + x * (d2 + x * (d3 + x * (d4 + x * d5)))));
}

// The split sum of kelemen (MODEL 9): a and b, with which a constant environment of 1 is reflected as f0 a + b, at
// N.V' and a roughness of [0.05, 1], to 2e-4. At views that graze more than 1e-6 it stays: there its slope is
// infinite. Fitted to the exact integrals and printed by specular/fitted.rs; nobody writes here.
fn split_sum_kelemen(view_cosine: f32, roughness: f32) -> vec2f {
    let view: f32 = max(view_cosine, 1e-6);
    let y: f32 = 2.1052632 * roughness - 1.1052631;
    let lost_layer: f32 = 2.0 * roughness;
    let lost: f32 = kelemen_lost(2.0 * sqrt(view * (1.0 + lost_layer) / (view + lost_layer)) - 1.0, y);
    let mean_layer: f32 = 2.0 * roughness;
    let mean: f32 = max(kelemen_mean(2.0 * sqrt(view * (1.0 + mean_layer) / (view + mean_layer)) - 1.0, y), 0.0);
    let all: f32 = 1.0 - lost * lost;
    let square: f32 = mean * mean;
    let grazing: f32 = all * (square * square * mean);
    return vec2f(all - grazing, grazing);
}
