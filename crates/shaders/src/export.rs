//! One search with its parameters set, as a shader of its own: WGSL, or by naga GLSL, HLSL and MSL.

use naga::back::{glsl, hlsl, msl};
use naga::proc::BoundsCheckPolicies;
use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
use naga::{Module, ShaderStage};
use thiserror::Error;

use crate::compose::{ComposeError, compose_paths};
use crate::reflect::{ReflectError, validate};

/// A shading language.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Language {
    /// WebGPU: the composed sources themselves, comments and all.
    Wgsl,
    /// OpenGL ES 3.00, as WebGL 2 takes it, for searches that read nothing but a height texture; 3.10 for
    /// those that read buffers.
    Glsl,
    /// Shader model 5.1 and up.
    Hlsl,
    /// Metal 2.0 and up.
    Msl,
}

impl Language {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Wgsl, Self::Glsl, Self::Hlsl, Self::Msl];

    /// The name in lower case.
    pub fn name(self) -> &'static str {
        match self {
            Self::Wgsl => "wgsl",
            Self::Glsl => "glsl",
            Self::Hlsl => "hlsl",
            Self::Msl => "msl",
        }
    }
}

/// A search that cannot be written out.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum ExportError {
    /// No such search.
    #[error(transparent)]
    Compose(#[from] ComposeError),
    /// A constant that the search does not have.
    #[error("search {search:?} has no constant {name:?}")]
    Constant {
        /// The search.
        search: String,
        /// The constant.
        name: String,
    },
    /// The program is not valid.
    #[error(transparent)]
    Invalid(#[from] ReflectError),
    /// naga cannot say it in that language.
    #[error("{language}: {problem}")]
    Translate {
        /// The language.
        language: &'static str,
        /// naga's message.
        problem: String,
    },
}

/// Name of the entry point.
const ENTRY: &str = "search_fragment";

/// Shows how the two functions are called, and makes the program whole for languages that write out only
/// what an entry point needs.
const FRAGMENT: &str = "
// ---- entry point
// start, delta: texture-space segment (u, v, z) of the view ray, from the lid z = 1 to the floor z = 0;
// cos_theta: cosine between ray and normal in mesh units. The result: position along the segment, status
// (0 hit, 1 left, 2 unconverged), steps, and whether a ray on to `light` from there is blocked.
@fragment
fn search_fragment(
    @location(0) start: vec3f,
    @location(1) delta: vec3f,
    @location(2) cos_theta: f32,
    @location(3) light: vec3f,
) -> @location(0) vec4f {
    let found = search(start, delta, cos_theta, WHOLE_STRETCH);
    let blocked = occluded(start + found.tau * delta, light, cos_theta, WHOLE_STRETCH);
    return vec4f(found.tau, f32(found.status), f32(found.steps), select(0.0, 1.0, blocked));
}
";

/// `search/<name>.wgsl` with everything it needs, its constants set for good, and an entry point that calls
/// it.
///
/// # Errors
/// [`ExportError`].
pub fn export_search(
    name: &str,
    constants: &[(&str, String)],
    language: Language,
) -> Result<String, ExportError> {
    let composed = compose_paths([format!("search/{name}.wgsl").as_str()])?;
    let source = format!("{}{FRAGMENT}", settle(&composed, name, constants)?);
    let module = validate(&source)?;
    let fail = |problem: String| ExportError::Translate { language: language.name(), problem };
    let info = Validator::new(ValidationFlags::all(), Capabilities::default())
        .validate(&module)
        .map_err(|error| fail(error.emit_to_string(&source)))?;
    match language {
        Language::Wgsl => Ok(source),
        Language::Glsl => to_glsl(&module, &info).map_err(fail),
        Language::Hlsl => to_hlsl(&module, &info).map_err(fail),
        Language::Msl => to_msl(&module, &info).map_err(fail),
    }
}

/// Turns each `override` into a `const`, of the value given or else of its default.
fn settle(source: &str, search: &str, constants: &[(&str, String)]) -> Result<String, ExportError> {
    let mut unused: Vec<&str> = constants.iter().map(|(name, _)| *name).collect();
    let mut settled = String::with_capacity(source.len());
    for line in source.lines() {
        let declared = line
            .strip_prefix("override ")
            .and_then(|rest| rest.split_once(':'))
            .and_then(|(name, rest)| Some((name, rest.split_once('=')?)));
        match declared {
            None => settled.push_str(line),
            Some((name, (kind, default))) => {
                let given = constants.iter().find(|(known, _)| *known == name);
                let value = given.map_or(default.trim().trim_end_matches(';'), |(_, value)| value.as_str());
                unused.retain(|known| *known != name);
                settled.push_str(&format!("const {name}: {} = {value};", kind.trim()));
            }
        }
        settled.push('\n');
    }
    match unused.first() {
        None => Ok(settled),
        Some(name) => Err(ExportError::Constant { search: search.to_owned(), name: (*name).to_owned() }),
    }
}

fn to_glsl(module: &Module, info: &ModuleInfo) -> Result<String, String> {
    let buffers = module
        .global_variables
        .iter()
        .any(|(_, global)| matches!(global.space, naga::AddressSpace::Storage { .. }));
    let version = if buffers {
        glsl::Version::new_gles(310)
    } else {
        glsl::Version::Embedded { version: 300, is_webgl: true }
    };
    let options = glsl::Options { version, ..glsl::Options::default() };
    let pipeline = glsl::PipelineOptions {
        shader_stage: ShaderStage::Fragment,
        entry_point: ENTRY.to_owned(),
        multiview: None,
    };
    let mut text = String::new();
    glsl::Writer::new(&mut text, module, info, &options, &pipeline, BoundsCheckPolicies::default())
        .and_then(|mut writer| writer.write())
        .map_err(|error| error.to_string())?;
    Ok(text)
}

fn to_hlsl(module: &Module, info: &ModuleInfo) -> Result<String, String> {
    let options = hlsl::Options { fake_missing_bindings: true, ..hlsl::Options::default() };
    let pipeline = hlsl::PipelineOptions::default();
    let mut text = String::new();
    hlsl::Writer::new(&mut text, &options, &pipeline)
        .write(module, info, None)
        .map_err(|error| error.to_string())?;
    Ok(text)
}

fn to_msl(module: &Module, info: &ModuleInfo) -> Result<String, String> {
    let options = msl::Options {
        fake_missing_bindings: false,
        lang_version: (2, 0),
        per_entry_point_map: [(ENTRY.to_owned(), metal_slots(module))].into(),
        ..msl::Options::default()
    };
    msl::write_string(module, info, &options, &msl::PipelineOptions::default())
        .map(|(text, _)| text)
        .map_err(|error| error.to_string())
}

/// Slots of buffers, textures and samplers, each numbered by itself in the order of their declaration; behind the
/// buffers comes one with the sizes of those that end in an array.
fn metal_slots(module: &Module) -> msl::EntryPointResources {
    let mut slots = msl::EntryPointResources::default();
    let (mut buffers, mut textures, mut samplers) = (0, 0, 0);
    let next = |count: &mut u8| {
        *count += 1;
        Some(*count - 1)
    };
    for (_, global) in module.global_variables.iter() {
        let Some(binding) = global.binding else { continue };
        let mut target = msl::BindTarget::default();
        match module.types[global.ty].inner {
            naga::TypeInner::Image { .. } => target.texture = next(&mut textures),
            naga::TypeInner::Sampler { .. } => {
                target.sampler = next(&mut samplers).map(msl::BindSamplerTarget::Resource);
            }
            _ => target.buffer = next(&mut buffers),
        }
        slots.resources.insert(binding, target);
    }
    slots.sizes_buffer = next(&mut buffers);
    slots
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn constants_are_settled_and_unknown_ones_named() {
        let text = export_search("relief", &[("linear", "48".to_owned())], Language::Wgsl).unwrap();
        assert!(text.contains("const linear: i32 = 48;") && text.contains("const refine: i32 = 8;"));
        assert!(!text.contains("override "));
        let error = export_search("relief", &[("layers", "4".to_owned())], Language::Wgsl).unwrap_err();
        assert!(error.to_string().contains("\"layers\""), "{error}");
        assert!(matches!(export_search("reliev", &[], Language::Glsl), Err(ExportError::Compose(_))));
    }

    #[test]
    fn every_search_is_written_in_every_language() {
        let searches: Vec<&str> =
            crate::files().filter_map(|path| path.strip_prefix("search/")?.strip_suffix(".wgsl")).collect();
        assert!(searches.len() > 10);
        for name in searches {
            for language in Language::ALL {
                let text =
                    export_search(name, &[], language).unwrap_or_else(|e| panic!("{name} {language:?}: {e}"));
                let mark = match language {
                    Language::Wgsl => "@fragment",
                    Language::Glsl => "#version 3",
                    Language::Hlsl => "SV_Target",
                    Language::Msl => "metal_stdlib",
                };
                assert!(text.contains(mark), "{name} {language:?}:\n{text}");
                assert!(text.contains("search") && text.contains("occluded"), "{name} {language:?}");
            }
        }
    }

    #[test]
    fn metal_gets_slots_that_it_has() {
        let text = export_search("exact", &[], Language::Msl).unwrap();
        for slot in ["[[texture(0)]]", "[[sampler(0)]]", "[[buffer(0)]]", "[[buffer(1)]]", "[[buffer(2)]]"] {
            assert_eq!(text.matches(slot).count(), 1, "{slot}");
        }
        assert!(!text.contains("fake"));
    }

    #[test]
    fn the_constant_reaches_the_translation() {
        for language in [Language::Glsl, Language::Hlsl, Language::Msl] {
            let text = export_search("pom", &[("steps", "771".to_owned())], language).unwrap();
            assert!(text.contains("771"), "{language:?}");
        }
    }
}
