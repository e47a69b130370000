//! Pipelines, compiled once for each program with its constants.

use std::sync::Arc;

use heightfield::technique::Reads;
use heightfield::{HeightField, Technique};

use crate::device::lock;
use crate::layouts::BesideDraw;
use crate::request::Program;
use crate::targets::{DEPTH_FORMAT, TARGET_FORMATS, TargetSet};
use crate::{Device, RenderError, TechniqueChoice, tally};

/// All that makes one pipeline different from another.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) struct PipelineKey {
    pub program: Program,
    pub reads: Option<Reads>,
    pub constants: Vec<(&'static str, i64)>,
    pub targets: TargetSet,
    /// Whether hidden fragments go before they are marched: the draw is sorted by its mesh.
    pub apart: bool,
    pub double_sided: bool,
    pub mirrored: bool,
}

/// A compiled pipeline.
pub(crate) enum Pipeline {
    Render(wgpu::RenderPipeline),
    Compute(wgpu::ComputePipeline),
}

/// Vertex attributes in the order of their shader locations.
pub(crate) const ATTRIBUTES: [(&str, wgpu::VertexFormat); 10] = [
    ("position", wgpu::VertexFormat::Float32x3),
    ("normal", wgpu::VertexFormat::Float32x3),
    ("uv", wgpu::VertexFormat::Float32x2),
    ("dpdu", wgpu::VertexFormat::Float32x3),
    ("dpdv", wgpu::VertexFormat::Float32x3),
    ("tangent", wgpu::VertexFormat::Float32x4),
    ("dndu", wgpu::VertexFormat::Float32x3),
    ("dndv", wgpu::VertexFormat::Float32x3),
    ("face", wgpu::VertexFormat::Uint32),
    ("weights", wgpu::VertexFormat::Float32x2),
];

/// The locations that an entry reads.
pub(crate) fn attributes(entry: &str) -> &'static [usize] {
    match entry {
        "sloped" => &[0, 1, 2, 3, 4],
        "bent" | "relief" => &[0, 1, 2, 3, 4, 6, 7],
        "mapped" | "dot3" => &[0, 1, 2, 5],
        "relief_mapped" => &[0, 1, 2, 3, 4, 5],
        "displaced" => &[0, 8, 9],
        "shell" => &[0],
        _ => &[0, 1, 2],
    }
}

/// What a technique reads besides its material.
pub(crate) fn reads_of(technique: &TechniqueChoice) -> Option<Reads> {
    match technique {
        TechniqueChoice::Search(technique) => Some(technique.info.reads),
        TechniqueChoice::Plain(plain) => plain.reads,
    }
}

/// Values of the override constants of a search over a field.
pub(crate) fn constants_of(technique: &Technique, field: &HeightField) -> Vec<(&'static str, i64)> {
    let mut constants: Vec<_> = technique.settings().map(|(name, value)| (name, value as i64)).collect();
    if technique.info.reads == Reads::Pyramid {
        constants.push(("endless", i64::from(!field.is_periodic())));
    }
    constants
}

impl Device {
    fn constants(&self, key: &PipelineKey) -> Vec<(&'static str, f64)> {
        let mut constants: Vec<_> = key.constants.iter().map(|&(name, value)| (name, value as f64)).collect();
        if key.reads == Some(Reads::Heights) {
            constants.push(("manual_bilinear", f64::from(u8::from(self.manual_bilinear))));
        }
        constants
    }

    fn field_layout(&self, reads: Option<Reads>) -> Option<&wgpu::BindGroupLayout> {
        reads.map(|reads| match reads {
            Reads::Heights => &self.layouts.heights,
            Reads::Pyramid => &self.layouts.pyramid,
            Reads::Cone
            | Reads::ConeTexel
            | Reads::RelaxedCone
            | Reads::RelaxedConeTexel
            | Reads::Distance => &self.layouts.cells,
        })
    }

    /// The pipeline of that key, compiled if there is none.
    pub(crate) fn pipeline(&self, key: PipelineKey) -> Result<Arc<Pipeline>, RenderError> {
        if let Some(pipeline) = lock(&self.pipelines).get(&key) {
            return Ok(Arc::clone(pipeline));
        }
        let program = &key.program;
        let is_kernel = program.entry.starts_with("kernels/");
        let surface = if is_kernel { None } else { Some(program.surface) };
        let compose = if program.horizon { shaders::compose_with_horizon } else { shaders::compose };
        let source = compose(program.entry, program.search, surface)?;
        let constants = self.constants(&key);
        let pipeline = self.guard("compiling a pipeline", || {
            let module = self.device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some(program.entry),
                source: wgpu::ShaderSource::Wgsl(source.into()),
            });
            let options = wgpu::PipelineCompilationOptions {
                constants: &constants,
                zero_initialize_workgroup_memory: false,
            };
            Ok(if is_kernel {
                Pipeline::Compute(self.compute_pipeline(&key, &module, options))
            } else {
                Pipeline::Render(self.render_pipeline(&key, &module, options))
            })
        })?;
        tally::compiled();
        let pipeline = Arc::new(pipeline);
        lock(&self.pipelines).insert(key, Arc::clone(&pipeline));
        Ok(pipeline)
    }

    fn compute_pipeline(
        &self,
        key: &PipelineKey,
        module: &wgpu::ShaderModule,
        compilation_options: wgpu::PipelineCompilationOptions<'_>,
    ) -> wgpu::ComputePipeline {
        let layout = self.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(key.program.entry),
            bind_group_layouts: &[Some(&self.layouts.march), self.field_layout(key.reads)],
            immediate_size: 0,
        });
        self.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(key.program.entry),
            layout: Some(&layout),
            module,
            entry_point: None,
            compilation_options,
            cache: None,
        })
    }

    fn render_pipeline(
        &self,
        key: &PipelineKey,
        module: &wgpu::ShaderModule,
        compilation_options: wgpu::PipelineCompilationOptions<'_>,
    ) -> wgpu::RenderPipeline {
        let layout = self.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(key.program.entry),
            bind_group_layouts: &[
                Some(&self.layouts.frame),
                self.field_layout(key.reads),
                Some(self.layouts.material(key.program.maps, key.program.horizon)),
                Some(self.layouts.draw(BesideDraw::of(key.program.entry))),
            ],
            immediate_size: 0,
        });
        let attributes: Vec<[wgpu::VertexAttribute; 1]> = attributes(key.program.entry)
            .iter()
            .map(|&location| {
                [wgpu::VertexAttribute {
                    format: ATTRIBUTES[location].1,
                    offset: 0,
                    shader_location: location as u32,
                }]
            })
            .collect();
        let buffers: Vec<_> = attributes
            .iter()
            .map(|attribute| {
                Some(wgpu::VertexBufferLayout {
                    array_stride: attribute[0].format.size(),
                    step_mode: wgpu::VertexStepMode::Vertex,
                    attributes: attribute,
                })
            })
            .collect();
        let targets: Vec<_> = TARGET_FORMATS
            .iter()
            .enumerate()
            .map(|(at, &format)| {
                key.targets.has(at).then_some(wgpu::ColorTargetState {
                    format,
                    blend: None,
                    write_mask: wgpu::ColorWrites::ALL,
                })
            })
            .collect();
        self.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(key.program.entry),
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                module,
                entry_point: Some("vertex"),
                // Stages get the same constants; those that a stage does not use have no effect there.
                compilation_options: compilation_options.clone(),
                buffers: &buffers,
            },
            primitive: wgpu::PrimitiveState {
                // A mirroring transform turns the winding around.
                front_face: if key.mirrored { wgpu::FrontFace::Cw } else { wgpu::FrontFace::Ccw },
                cull_mode: match key.program.entry {
                    // The far sides of the box.
                    "shell" => Some(wgpu::Face::Front),
                    _ => (!key.double_sided).then_some(wgpu::Face::Back),
                },
                ..Default::default()
            },
            depth_stencil: Some(wgpu::DepthStencilState {
                format: DEPTH_FORMAT,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::Greater),
                stencil: wgpu::StencilState::default(),
                bias: wgpu::DepthBiasState::default(),
            }),
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module,
                entry_point: Some(if key.apart { "fragment_apart" } else { "fragment" }),
                compilation_options,
                targets: &targets,
            }),
            multiview_mask: None,
            cache: None,
        })
    }
}
