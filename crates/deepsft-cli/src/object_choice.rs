//! The object that a command shows or looks for: a model's template, a picture, or a template without a network.

use crate::failure::{BlameInput, usage};
use crate::input;
use crate::numbers::{SizeMm, positive};
use anyhow::{Result, anyhow};
use clap::Args;
use deepsft::features::{GradeLevel, PictureGrade};
use deepsft::{ALIKE, DeviceDescription, DeviceKind, SharedDescriptorNetwork, Target, TargetFinder, start_device};
use deepsft_formats::read_template;
use deepsft_geometry::{Picture, Template};
use std::path::{Path, PathBuf};

/// How far the ratio of the sides given may be from that of the picture, as a fraction: rounding, and a printer's margins.
const MAX_STRETCH: f64 = 0.05;

/// An object by its model, by its picture and size, or by its template.
#[derive(Debug, Args)]
pub struct ObjectChoice {
    #[command(flatten)]
    source: ObjectSource,
    /// Printed size of the picture in mm: WIDTHxHEIGHT, or the width alone
    #[arg(long, value_name = "SIZE", requires = "picture")]
    size_mm: Option<SizeMm>,
    /// Diameter of the tin, bottle or tube that the picture goes around, mm
    #[arg(long, value_name = "MM", value_parser = positive, requires = "picture")]
    around_mm: Option<f64>,
}

#[derive(Debug, Args)]
#[group(required = true, multiple = false)]
struct ObjectSource {
    /// Model bundle of the object
    #[arg(long, value_name = "BUNDLE")]
    model: Option<PathBuf>,
    /// Picture (PNG, JPEG, WebP, ...) that is printed on a sheet: give --size-mm too. Nothing is trained
    #[arg(long, value_name = "FILE", requires = "size_mm")]
    picture: Option<PathBuf>,
    /// Folder of the object's template
    #[arg(long, value_name = "DIR")]
    template: Option<PathBuf>,
}

/// An object to look for, and what it is looked for by.
#[derive(Debug, Args)]
pub struct FinderChoice {
    #[command(flatten)]
    object: ObjectChoice,
    /// Weights of the network that describes any picture (models/any-picture/weights.bpk): it is asked where corners are
    /// not enough
    #[arg(long, value_name = "FILE")]
    descriptors: Option<PathBuf>,
    /// Picture of the same series, printed as wide: where that one is seen, the object does not count as found. May be given several times
    #[arg(long = "lookalike", value_name = "FILE", requires = "picture")]
    lookalikes: Vec<PathBuf>,
}

/// The finders of an object.
pub struct ChosenFinder {
    /// All of them, the object's network among them.
    pub finder: TargetFinder,
    /// It tells the object apart from these while they live.
    _lookalikes: Vec<TargetFinder>,
    /// The model's name, or the path that was given.
    pub name: String,
    /// What the network runs on, if there is one.
    pub device: Option<DeviceDescription>,
}

impl FinderChoice {
    /// Whether the object has a network of its own.
    pub fn has_model(&self) -> bool {
        self.object.source.model.is_some()
    }

    /// Reads what finders look for and what they look by. Only a model's network needs `device`. A picture that features find badly is warned
    /// of where no network was trained for it.
    pub fn finder(&self, device: DeviceKind) -> Result<ChosenFinder> {
        let source = &self.object.source;
        let (target, name, device) = match &source.model {
            Some(folder) => {
                let bundle = input::bundle(folder)?;
                let (device, description) = pollster::block_on(start_device(device))?;
                (
                    Target::from_model(&bundle, &device)?,
                    bundle.name().to_owned(),
                    Some(description),
                )
            }
            None => {
                let path = source.picture.as_ref().or(source.template.as_ref());
                let name = path.map_or_else(String::new, |path| path.display().to_string());
                (Target::from_template(self.object.template()?), name, None)
            }
        };
        let mut finder = TargetFinder::new(target).blame("object", Path::new(&name))?;
        if !self.has_model()
            && let Some(grade) = finder.grade()
        {
            warn_of(&grade);
        }
        if let Some(path) = &self.descriptors {
            finder.add_descriptors(&descriptor_network(path).blame("weights", path)?)?;
        }
        let lookalikes = self.lookalikes.iter().map(|file| self.told_apart(file, &mut finder));
        Ok(ChosenFinder {
            _lookalikes: lookalikes.collect::<Result<_>>()?,
            finder,
            name,
            device,
        })
    }

    /// Makes `finder` tell the object apart from the picture of `file` while what is returned lives. Says how much they share.
    fn told_apart(&self, file: &Path, finder: &mut TargetFinder) -> Result<TargetFinder> {
        let size = self
            .object
            .size_mm
            .ok_or_else(|| usage("--lookalike needs --size-mm"))?;
        let template = printed(file, size, self.object.around_mm)?;
        let mut other = TargetFinder::new(Target::from_template(template))?;
        let share = finder.tell_apart(&mut other);
        let shares = format!(
            "{} shares {:.0} % of its corners with the picture",
            file.display(),
            100.0 * share
        );
        match share >= ALIKE {
            true => eprintln!("note: {shares}: the better one counts as found"),
            false => eprintln!("note: {shares}: too few to be taken for it"),
        }
        Ok(other)
    }
}

/// Reads the network that describes any picture onto the CPU.
fn descriptor_network(path: &Path) -> Result<SharedDescriptorNetwork> {
    SharedDescriptorNetwork::from_bytes(&std::fs::read(path)?).map_err(|_| {
        anyhow!("it holds no weights of the network that describes pictures: give models/any-picture/weights.bpk")
    })
}

/// Says what will make the picture on a sheet hard to find, or impossible without a network of its own.
pub fn warn_of_print(template: &Template) {
    match PictureGrade::of(template.clone()) {
        Ok(grade) => warn_of(&grade),
        Err(error) if template.is_sheet() => eprintln!("warning: it is not found without training: {error}"),
        Err(_) => {}
    }
}

fn warn_of(grade: &PictureGrade) {
    if grade.level < GradeLevel::Good {
        for advice in &grade.advice {
            eprintln!("warning: {advice}");
        }
    }
}

impl ObjectChoice {
    /// Reads the template to show it, and says what will make a --picture hard to find.
    pub fn template_to_show(&self) -> Result<Template> {
        let template = self.template()?;
        if self.source.picture.is_some() {
            warn_of_print(&template);
        }
        Ok(template)
    }

    /// Reads the template.
    pub fn template(&self) -> Result<Template> {
        let ObjectSource {
            model,
            picture,
            template,
        } = &self.source;
        if let Some(bundle) = model {
            return Ok(input::bundle(bundle)?.template().clone());
        }
        if let (Some(file), Some(size)) = (picture, self.size_mm) {
            return printed(file, size, self.around_mm);
        }
        match template {
            Some(folder) => Ok(read_template(folder)?),
            None => Err(usage("--model, --template, or --picture and --size-mm are needed")),
        }
    }
}

/// The sheet that carries the picture of `file`, or the label around a cylinder of the diameter `around_mm`.
pub fn printed(file: &Path, size: SizeMm, around_mm: Option<f64>) -> Result<Template> {
    let picture = input::picture(file)?;
    let sheet = |picture: Picture| {
        let ratio = picture.height() as f64 / picture.width() as f64;
        let [width_mm, height_mm] = size.of(&picture);
        let stretch = height_mm / width_mm / ratio;
        if (stretch - 1.0).abs() > MAX_STRETCH {
            return Err(anyhow!(
                "it has {} pixels, which do not fit {width_mm} x {height_mm} mm: width comes first, and the \
                 size is that of the picture without the paper's margins",
                picture.size()
            ));
        }
        Ok(match around_mm {
            None => Template::thin_shell(picture, width_mm, height_mm)?,
            Some(diameter) => Template::around_cylinder(picture, [width_mm, height_mm], diameter)?,
        })
    };
    sheet(picture).blame("picture", file)
}
