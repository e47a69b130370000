// Highlights of a surface seen from so far that a pixel holds many of its slopes: as wide as those spread them, and as
// much weaker. Source: Toksvig, "Mipmapping Normal Maps", Journal of Graphics Tools 10(3), 2005; Olano and Baker,
// "LEAN Mapping", I3D 2010.

// Whether highlights widen.
override specular_aa: bool = true;

// Variance of the slopes within the pixel along each axis, rise over run; a surface/*.wgsl sets it.
var<private> slope_variance: f32;

// Share and exponent of the highlight. A Blinn-Phong lobe of exponent n is close to a Gaussian of slopes with
// variance 1 / n; spread by another variance it keeps its light.
fn spread_gloss(specular: f32, shininess: f32) -> vec2f {
    let narrower = select(1.0, 1.0 / (1.0 + shininess * slope_variance), specular_aa);
    return vec2f(specular, shininess) * narrower;
}
