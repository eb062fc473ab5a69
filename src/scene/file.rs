//! Scene files: the tables, and what may stand in them.

use super::fault::{FieldFault, Places, SceneFault};
use super::mesh_source::MeshSource;
use super::motion::{FramesTable, Twist};
use super::placement::{Copies, Placement};
use super::settings::SettingsTable;
use crate::math::Vec3;
use serde::{Deserialize, Serialize};

/// A scene file.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneFile {
    pub title: String,
    /// What it shows or reproduces.
    #[serde(default)]
    pub about: String,
    /// Time step `[s]`.
    pub dt: f64,
    /// `[s]`
    pub duration: f64,
    /// `[m/s^2]`
    #[serde(default = "earth")]
    pub gravity: Vec3,
    /// Velocity of the air `[m/s]`.
    #[serde(default)]
    pub wind: Vec3,
    /// The axis that points up, for pictures and the animated cache.
    #[serde(default)]
    pub up: Up,
    /// Distance that `--jitter` moves starts by at most `[m]`; without: a thousandth of the body's mean edge.
    pub jitter: Option<f64>,
    #[serde(default)]
    pub settings: SettingsTable,
    #[serde(default)]
    pub output: Output,
    #[serde(default)]
    pub bounds: Bounds,
    #[serde(default)]
    pub sheet: Vec<SheetTable>,
    #[serde(default)]
    pub solid: Vec<SolidTable>,
    #[serde(default)]
    pub rigid: Vec<RigidTable>,
    #[serde(default)]
    pub kinematic: Vec<KinematicTable>,
    #[serde(default)]
    pub half_space: Vec<HalfSpaceTable>,
}

fn earth() -> Vec3 {
    [0.0, 0.0, -9.81]
}

fn one() -> f64 {
    1.0
}

fn yes() -> bool {
    true
}

/// An axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Up {
    Y,
    #[default]
    Z,
}

/// What `--out` writes.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Output {
    /// Frames per second of the scene, rounded to whole steps.
    #[serde(default = "film")]
    pub frames_per_second: f64,
    /// One OBJ file per frame.
    #[serde(default = "yes")]
    pub obj: bool,
    /// One animated USD file.
    #[serde(default = "yes")]
    pub usd: bool,
    /// Where pictures are taken from, and the point in their middle `[m]`; without: a view of all.
    pub camera: Option<Vec3>,
    pub look_at: Option<Vec3>,
}

fn film() -> f64 {
    25.0
}

impl Default for Output {
    fn default() -> Self {
        Output { frames_per_second: film(), obj: true, usd: true, camera: None, look_at: None }
    }
}

/// What a run must keep to. A certified intersection always breaks the run. Bounds marked *end* hold only for runs over
/// the whole duration of the scene as it is written.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bounds {
    /// Contacts of the step with the most, at least. *End.*
    pub contacts_min: Option<u32>,
    /// Contacts of the step with the most, at most.
    pub contacts_max: Option<u32>,
    /// Steps that were divided.
    pub divisions_max: Option<u32>,
    /// Steps with zones or held vertices.
    pub fail_safes_max: Option<u32>,
    /// Steps that ended pinched.
    pub pinched_max: Option<u32>,
    /// At least. *End.*
    pub pinched_min: Option<u32>,
    /// Steps in which a solve stopped at its work cap.
    pub not_converged_max: Option<u32>,
    /// Share of the steps with contact that took three rounds or fewer.
    pub rounds_within_three_min: Option<f64>,
    /// Kinetic energy at the end `[J/kg]`. *End.*
    pub kinetic_energy_end_max: Option<f64>,
    /// Where bodies end. *End.*
    #[serde(default)]
    pub body: Vec<BodyBound>,
}

/// Where a body (the first with that name) ends: its centre of mass along a direction.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BodyBound {
    pub name: String,
    pub direction: Vec3,
    /// Way from the start `[m]`.
    pub travel_min: Option<f64>,
    pub travel_max: Option<f64>,
    /// Velocity `[m/s]`.
    pub speed_min: Option<f64>,
    pub speed_max: Option<f64>,
}

/// What every body has for contact.
#[derive(Clone, Debug)]
pub struct Contact {
    pub friction: f64,
    pub restitution: f64,
    pub half_thickness: Option<f64>,
    pub groups: Vec<u32>,
    pub mask: Option<Vec<u32>>,
    pub self_collision: bool,
}

macro_rules! body_table {
    ($(#[$doc:meta])* $name:ident { $($(#[$attribute:meta])* $field:ident: $type:ty,)* }) => {
        $(#[$doc])*
        #[derive(Clone, Debug, Deserialize)]
        #[serde(deny_unknown_fields)]
        pub struct $name {
            pub name: String,
            #[serde(default)]
            pub friction: f64,
            #[serde(default)]
            pub restitution: f64,
            pub half_thickness: Option<f64>,
            #[serde(default)]
            pub groups: Vec<u32>,
            pub mask: Option<Vec<u32>>,
            #[serde(default = "yes")]
            pub self_collision: bool,
            $($(#[$attribute])* pub $field: $type,)*
        }

        impl $name {
            /// What it has for contact.
            pub fn contact(&self) -> Contact {
                Contact {
                    friction: self.friction,
                    restitution: self.restitution,
                    half_thickness: self.half_thickness,
                    groups: self.groups.clone(),
                    mask: self.mask.clone(),
                    self_collision: self.self_collision,
                }
            }

            fn check_contact(&self, at: &str) -> Result<(), FieldFault> {
                not_negative(self.friction, at, "friction")?;
                if !(0.0..=1.0).contains(&self.restitution) {
                    let message = format!("between 0 and 1, not {}", self.restitution);
                    return Err(FieldFault::new(format!("{at}.restitution"), message));
                }
                if let Some(half) = self.half_thickness {
                    not_negative(half, at, "half_thickness")?;
                }
                for (what, list) in [("groups", Some(&self.groups)), ("mask", self.mask.as_ref())] {
                    if let Some(i) = list.and_then(|list| list.iter().position(|group| *group > 63)) {
                        return Err(FieldFault::new(format!("{at}.{what}[{i}]"), "groups are numbered 0 to 63"));
                    }
                }
                Ok(())
            }
        }
    };
}

body_table!(
    /// Cloth or shell.
    SheetTable {
        mesh: MeshSource,
        #[serde(default)]
        placement: Placement,
        copies: Option<Copies>,
        material: SheetMaterialTable,
        /// Start velocity `[m/s]`.
        #[serde(default)]
        velocity: Vec3,
        /// Start angular velocity about the middle of the vertices `[rad/s]`.
        #[serde(default)]
        angular_velocity: Vec3,
        /// Drag of the faces in the air `[kg/m^3]`.
        #[serde(default)]
        drag: f64,
        #[serde(default)]
        pins: Vec<Pin>,
    }
);

body_table!(
    /// Solid of tetrahedra.
    SolidTable {
        mesh: MeshSource,
        /// A surface that the tetrahedra carry; without: their own.
        surface: Option<MeshSource>,
        #[serde(default)]
        placement: Placement,
        copies: Option<Copies>,
        material: SolidMaterialTable,
        /// Start velocity `[m/s]`.
        #[serde(default)]
        velocity: Vec3,
        /// Start angular velocity about the middle of the nodes `[rad/s]`.
        #[serde(default)]
        angular_velocity: Vec3,
        #[serde(default)]
        drag: f64,
        #[serde(default)]
        pins: Vec<Pin>,
    }
);

body_table!(
    /// Rigid body of uniform density, a closed mesh.
    RigidTable {
        mesh: MeshSource,
        #[serde(default)]
        placement: Placement,
        copies: Option<Copies>,
        /// `[kg/m^3]`
        density: f64,
        #[serde(default)]
        velocity: Vec3,
        #[serde(default)]
        angular_velocity: Vec3,
        /// Rate at which velocity decays `[1/s]`.
        #[serde(default)]
        linear_damping: f64,
        /// Rate at which angular velocity decays `[1/s]`.
        #[serde(default)]
        angular_damping: f64,
    }
);

body_table!(
    /// Body of prescribed motion.
    KinematicTable {
        mesh: MeshSource,
        #[serde(default)]
        placement: Placement,
        /// The point that turns leave in place at the start; without: the position of the placement.
        centre: Option<Vec3>,
        #[serde(default)]
        motion: Vec<Twist>,
        /// Positions of the vertices from a file; a motion carries them along.
        frames: Option<FramesTable>,
    }
);

body_table!(
    /// All points with `normal . x >= offset`.
    HalfSpaceTable {
        normal: Vec3,
        #[serde(default)]
        offset: f64,
        /// Velocities only; the plane moves by their part along the normal.
        #[serde(default)]
        motion: Vec<Twist>,
    }
);

/// Vertices that do not move, or move as prescribed.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pin {
    /// By index.
    #[serde(default)]
    pub vertices: Vec<u32>,
    /// All within a box of the world at the start: lower and upper corner `[m]`.
    pub within: Option<[Vec3; 2]>,
    /// The point that turns leave in place at the start; without: the middle of the vertices.
    pub centre: Option<Vec3>,
    #[serde(default)]
    pub motion: Vec<Twist>,
    /// Name of a kinematic body: pinned vertices follow its motion, and of its frames the way of the nearest vertex.
    pub follow: Option<String>,
    /// With a body to follow: instead of the nearest vertex's, the mean way of all within this distance at the start
    /// `[m]`, the nearer the more. Pins of layers over each other stay in order so.
    pub follow_within: Option<f64>,
}

/// Material of a sheet.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SheetMaterialTable {
    /// `[kg/m^3]`
    pub density: f64,
    /// `[m]`
    pub thickness: f64,
    /// `[Pa]`
    pub young_modulus: f64,
    #[serde(default)]
    pub poisson_ratio: f64,
    /// `[N m]`; without: that of a plate.
    pub bending_stiffness: Option<f64>,
    #[serde(default)]
    pub flat: bool,
    #[serde(default = "one")]
    pub rest_scale: f64,
    /// `[1/s]`
    #[serde(default)]
    pub mass_damping: f64,
    /// `[s]`
    #[serde(default)]
    pub stretch_damping: f64,
    /// `[s]`
    #[serde(default)]
    pub bending_damping: f64,
    /// Given: springs instead of membranes, those across edges with this part of the stiffness of the edge.
    pub spring_bend_ratio: Option<f64>,
}

/// Material of a solid.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SolidMaterialTable {
    /// `[kg/m^3]`
    pub density: f64,
    /// `[Pa]`
    pub young_modulus: f64,
    pub poisson_ratio: f64,
    #[serde(default = "one")]
    pub rest_scale: f64,
    /// `[1/s]`
    #[serde(default)]
    pub mass_damping: f64,
    /// `[s]`
    #[serde(default)]
    pub stretch_damping: f64,
}

impl SceneFile {
    /// Reads a scene. Errors: what is no TOML, a field that is missing, unknown, of the wrong type or out of its range,
    /// with file, line and field.
    pub fn parse(file: &str, text: &str) -> Result<SceneFile, SceneFault> {
        let places = Places::new(file, text);
        let scene: SceneFile = toml::from_str(text).map_err(|error| places.parser_fault(&error))?;
        scene.check().map_err(|fault| places.fault(fault))?;
        Ok(scene)
    }

    /// Gives every body the friction coefficient.
    pub fn set_friction(&mut self, friction: f64) {
        self.sheet.iter_mut().for_each(|table| table.friction = friction);
        self.solid.iter_mut().for_each(|table| table.friction = friction);
        self.rigid.iter_mut().for_each(|table| table.friction = friction);
        self.kinematic.iter_mut().for_each(|table| table.friction = friction);
        self.half_space.iter_mut().for_each(|table| table.friction = friction);
    }

    /// Steps of the whole duration.
    pub fn steps(&self) -> u64 {
        (self.duration / self.dt).round() as u64
    }

    fn check(&self) -> Result<(), FieldFault> {
        positive(self.dt, "", "dt")?;
        positive(self.duration, "", "duration")?;
        if self.steps() == 0 {
            return Err(FieldFault::new("duration", "shorter than half a step"));
        }
        finite(self.gravity, "", "gravity")?;
        finite(self.wind, "", "wind")?;
        if let Some(jitter) = self.jitter {
            not_negative(jitter, "", "jitter")?;
        }
        positive(self.output.frames_per_second, "output", "frames_per_second")?;
        finite(self.output.camera.unwrap_or_default(), "output", "camera")?;
        finite(self.output.look_at.unwrap_or_default(), "output", "look_at")?;
        self.settings.check()?;
        for (i, table) in self.sheet.iter().enumerate() {
            table.check(&format!("sheet[{i}]"))?;
        }
        for (i, table) in self.solid.iter().enumerate() {
            table.check(&format!("solid[{i}]"))?;
        }
        for (i, table) in self.rigid.iter().enumerate() {
            table.check(&format!("rigid[{i}]"))?;
        }
        for (i, table) in self.kinematic.iter().enumerate() {
            table.check(&format!("kinematic[{i}]"))?;
        }
        for (i, table) in self.half_space.iter().enumerate() {
            table.check(&format!("half_space[{i}]"))?;
        }
        self.check_names()
    }

    /// Names are unique, and bounds name bodies.
    fn check_names(&self) -> Result<(), FieldFault> {
        let mut names: Vec<(&str, String)> = Vec::new();
        names.extend(self.sheet.iter().enumerate().map(|(i, t)| (t.name.as_str(), format!("sheet[{i}].name"))));
        names.extend(self.solid.iter().enumerate().map(|(i, t)| (t.name.as_str(), format!("solid[{i}].name"))));
        names.extend(self.rigid.iter().enumerate().map(|(i, t)| (t.name.as_str(), format!("rigid[{i}].name"))));
        let movable = names.len();
        names.extend(self.kinematic.iter().enumerate().map(|(i, t)| (t.name.as_str(), format!("kinematic[{i}].name"))));
        names.extend(
            self.half_space.iter().enumerate().map(|(i, t)| (t.name.as_str(), format!("half_space[{i}].name"))),
        );
        if names.is_empty() {
            return Err(FieldFault::new("", "a scene needs bodies: [[sheet]], [[solid]], [[rigid]], [[kinematic]]"));
        }
        for (i, (name, field)) in names.iter().enumerate() {
            if name.is_empty() {
                return Err(FieldFault::new(field, "a name is not empty"));
            }
            if names[..i].iter().any(|(other, _)| other == name) {
                return Err(FieldFault::new(field, format!("the name '{name}' is taken")));
            }
        }
        let pins = |kind: &str, i: usize, pins: &[Pin]| {
            pins.iter().enumerate().find_map(|(k, pin)| {
                let name = pin.follow.as_ref()?;
                let known = self.kinematic.iter().any(|table| table.name == *name);
                let message = format!("no kinematic body is named '{name}'");
                (!known).then(|| FieldFault::new(format!("{kind}[{i}].pins[{k}].follow"), message))
            })
        };
        let sheets = self.sheet.iter().enumerate().find_map(|(i, table)| pins("sheet", i, &table.pins));
        let solids = || self.solid.iter().enumerate().find_map(|(i, table)| pins("solid", i, &table.pins));
        if let Some(fault) = sheets.or_else(solids) {
            return Err(fault);
        }
        for (i, bound) in self.bounds.body.iter().enumerate() {
            if !names[..movable].iter().any(|(name, _)| *name == bound.name) {
                let message = format!("no sheet, solid or rigid body is named '{}'", bound.name);
                return Err(FieldFault::new(format!("bounds.body[{i}].name"), message));
            }
            finite(bound.direction, &format!("bounds.body[{i}]"), "direction")?;
        }
        Ok(())
    }
}

/// A table for each word of its copies' variants: with the word in its files' names and at its own slots.
macro_rules! variants {
    ($name:ident $(, $more:ident)?) => {
        impl $name {
            /// The table itself, or one for each of its copies' variants.
            pub fn variants(&self) -> Vec<$name> {
                let words = self.copies.as_ref().map_or(&[][..], |copies| &copies.variants);
                if words.is_empty() {
                    return vec![self.clone()];
                }
                let of = |(index, word): (usize, &String)| {
                    let copies = self.copies.clone();
                    $name {
                        name: format!("{}_{word}", self.name),
                        mesh: self.mesh.with_word(word),
                        copies: copies.map(|copies| Copies { variant: Some((index, words.len())), ..copies }),
                        $($more: self.$more.as_ref().map(|source| source.with_word(word)),)?
                        ..self.clone()
                    }
                };
                words.iter().enumerate().map(of).collect()
            }
        }
    };
}

variants!(SheetTable);
variants!(RigidTable);
variants!(SolidTable, surface);

impl SheetTable {
    fn check(&self, at: &str) -> Result<(), FieldFault> {
        self.check_contact(at)?;
        self.mesh.check(&format!("{at}.mesh"))?;
        check_free(at, &self.placement, self.copies.as_ref(), [self.velocity, self.angular_velocity])?;
        not_negative(self.drag, at, "drag")?;
        check_pins(at, &self.pins)?;
        let (m, at) = (&self.material, format!("{at}.material"));
        for (value, name) in [
            (m.density, "density"),
            (m.thickness, "thickness"),
            (m.young_modulus, "young_modulus"),
            (m.rest_scale, "rest_scale"),
        ] {
            positive(value, &at, name)?;
        }
        poisson(m.poisson_ratio, &at)?;
        for (value, name) in [
            (m.bending_stiffness.unwrap_or(0.0), "bending_stiffness"),
            (m.mass_damping, "mass_damping"),
            (m.stretch_damping, "stretch_damping"),
            (m.bending_damping, "bending_damping"),
            (m.spring_bend_ratio.unwrap_or(0.0), "spring_bend_ratio"),
        ] {
            not_negative(value, &at, name)?;
        }
        Ok(())
    }
}

impl SolidTable {
    fn check(&self, at: &str) -> Result<(), FieldFault> {
        self.check_contact(at)?;
        self.mesh.check(&format!("{at}.mesh"))?;
        if let Some(surface) = &self.surface {
            surface.check(&format!("{at}.surface"))?;
        }
        check_free(at, &self.placement, self.copies.as_ref(), [self.velocity, self.angular_velocity])?;
        not_negative(self.drag, at, "drag")?;
        check_pins(at, &self.pins)?;
        let (m, at) = (&self.material, format!("{at}.material"));
        for (value, name) in [(m.density, "density"), (m.young_modulus, "young_modulus"), (m.rest_scale, "rest_scale")]
        {
            positive(value, &at, name)?;
        }
        poisson(m.poisson_ratio, &at)?;
        not_negative(m.mass_damping, &at, "mass_damping")?;
        not_negative(m.stretch_damping, &at, "stretch_damping")
    }
}

impl RigidTable {
    fn check(&self, at: &str) -> Result<(), FieldFault> {
        self.check_contact(at)?;
        self.mesh.check(&format!("{at}.mesh"))?;
        check_free(at, &self.placement, self.copies.as_ref(), [self.velocity, self.angular_velocity])?;
        positive(self.density, at, "density")?;
        not_negative(self.linear_damping, at, "linear_damping")?;
        not_negative(self.angular_damping, at, "angular_damping")
    }
}

impl KinematicTable {
    fn check(&self, at: &str) -> Result<(), FieldFault> {
        self.check_contact(at)?;
        self.mesh.check(&format!("{at}.mesh"))?;
        self.placement.check(&format!("{at}.placement"))?;
        check_motion(&format!("{at}.motion"), &self.motion)?;
        if let Some(frames) = &self.frames {
            positive(frames.seconds_per_frame, &format!("{at}.frames"), "seconds_per_frame")?;
        }
        Ok(())
    }
}

impl HalfSpaceTable {
    fn check(&self, at: &str) -> Result<(), FieldFault> {
        self.check_contact(at)?;
        finite(self.normal, at, "normal")?;
        if self.normal == [0.0; 3] {
            return Err(FieldFault::new(format!("{at}.normal"), "a normal is not zero"));
        }
        finite([self.offset, 0.0, 0.0], at, "offset")?;
        check_motion(&format!("{at}.motion"), &self.motion)?;
        match self.motion.iter().position(|twist| twist.angular_velocity != [0.0; 3]) {
            Some(i) => {
                let field = format!("{at}.motion[{i}].angular_velocity");
                Err(FieldFault::new(field, "a half-space moves along its normal, it does not turn"))
            }
            None => Ok(()),
        }
    }
}

fn check_free(at: &str, placement: &Placement, copies: Option<&Copies>, v: [Vec3; 2]) -> Result<(), FieldFault> {
    placement.check(&format!("{at}.placement"))?;
    copies.map_or(Ok(()), |copies| copies.check(&format!("{at}.copies")))?;
    finite(v[0], at, "velocity")?;
    finite(v[1], at, "angular_velocity")
}

fn check_pins(at: &str, pins: &[Pin]) -> Result<(), FieldFault> {
    for (i, pin) in pins.iter().enumerate() {
        if pin.vertices.is_empty() && pin.within.is_none() {
            return Err(FieldFault::new(format!("{at}.pins[{i}]"), "a pin names vertices or a box: vertices, within"));
        }
        check_motion(&format!("{at}.pins[{i}].motion"), &pin.motion)?;
        if let Some(within) = pin.follow_within {
            positive(within, &format!("{at}.pins[{i}]"), "follow_within")?;
        }
        if pin.follow.is_some() && !pin.motion.is_empty() {
            return Err(FieldFault::new(format!("{at}.pins[{i}].follow"), "a pin has a motion or a body to follow"));
        }
    }
    Ok(())
}

/// The phases of a motion follow each other.
fn check_motion(at: &str, motion: &[Twist]) -> Result<(), FieldFault> {
    let mut last = 0.0;
    for (i, twist) in motion.iter().enumerate() {
        let at = format!("{at}[{i}]");
        finite(twist.velocity, &at, "velocity")?;
        finite(twist.angular_velocity, &at, "angular_velocity")?;
        // Not a number fails, too.
        if twist.until.partial_cmp(&last) != Some(std::cmp::Ordering::Greater) {
            let message = format!("ends at {} s, which is not after {last} s", twist.until);
            return Err(FieldFault::new(format!("{at}.until"), message));
        }
        last = twist.until;
    }
    Ok(())
}

fn joined(at: &str, name: &str) -> String {
    if at.is_empty() { name.to_string() } else { format!("{at}.{name}") }
}

/// Errors unless positive and finite.
pub fn positive(value: f64, at: &str, name: &str) -> Result<(), FieldFault> {
    if value > 0.0 && value.is_finite() {
        return Ok(());
    }
    Err(FieldFault::new(joined(at, name), format!("positive and finite, not {value}")))
}

/// Errors unless finite and not negative.
pub fn not_negative(value: f64, at: &str, name: &str) -> Result<(), FieldFault> {
    if value >= 0.0 && value.is_finite() {
        return Ok(());
    }
    Err(FieldFault::new(joined(at, name), format!("finite and not negative, not {value}")))
}

fn poisson(value: f64, at: &str) -> Result<(), FieldFault> {
    if (0.0..0.5).contains(&value) {
        return Ok(());
    }
    Err(FieldFault::new(joined(at, "poisson_ratio"), format!("at least 0 and below 0.5, not {value}")))
}

/// Errors unless all components are finite.
pub fn finite(v: Vec3, at: &str, name: &str) -> Result<(), FieldFault> {
    match v.iter().find(|c| !c.is_finite()) {
        Some(value) => Err(FieldFault::new(joined(at, name), format!("finite, not {value}"))),
        None => Ok(()),
    }
}
