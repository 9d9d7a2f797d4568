//! Plan of a data set: the footage, the parameters and the look of each flock. A flock depends on the seed and on
//! its number only, so the flocks before it may change, and each is planned when it is needed: the plan of a large data set
//! is as small as that of a small one.

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use super::dice::{Choice, Dice};
use super::{Look, Params};
use crate::flock;
use crate::flock::composite::params::Background;
use crate::formats::params::{self, Error};

/// All flocks of a data set.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    params: Params,
    sizes_px: Vec<[u32; 2]>,
    n_pictures: usize,
    splits: Vec<Split>,
}

/// One flock of a data set.
#[derive(Clone, Debug, PartialEq)]
pub struct Sequence {
    /// Number of the flock, from 0.
    pub number: u32,
    /// Subset to which its pictures belong.
    pub split: Split,
    /// Index of the library.
    pub library: usize,
    /// Preset of the flock.
    pub preset: String,
    /// Parameters of the flock.
    pub params: flock::Params,
    /// Background.
    pub ground: Ground,
    /// Camera.
    pub look: Look,
}

/// Subset of a data set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Split {
    /// For training.
    Train,
    /// For choosing settings during training.
    Val,
    /// For the final test.
    Test,
}

impl Split {
    /// All subsets.
    pub const ALL: [Split; 3] = [Split::Train, Split::Val, Split::Test];

    /// Returns the name in paths.
    pub fn name(self) -> &'static str {
        match self {
            Split::Train => "train",
            Split::Val => "val",
            Split::Test => "test",
        }
    }
}

/// Background of a flock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ground {
    /// As the flock's parameters say: the footage's background or a color.
    FromParams,
    /// The given picture with this index.
    Picture(usize),
}

impl Plan {
    /// Plans a data set. `sizes_px` are the sizes of the footage of each library, at least one, and `n_pictures` is
    /// the number of background pictures. Fails if a flock's parameters are invalid.
    ///
    /// Whether they are depends on the preset, and on products of the number of individuals and of the size with others. So
    /// the ends of these ranges are checked for each preset and library.
    pub fn new(params: &Params, sizes_px: &[[u32; 2]], n_pictures: usize) -> Result<Plan, Error> {
        for preset in &params.presets {
            for (count, scale) in params.count.iter().zip(params.scale) {
                for size_px in sizes_px {
                    checked(flock(params, preset, *count, 0, scaled(*size_px, scale))?)?;
                }
            }
        }
        Ok(Plan {
            params: params.clone(),
            sizes_px: sizes_px.to_vec(),
            n_pictures,
            splits: splits(params),
        })
    }

    /// Returns the number of flocks.
    pub fn n_flocks(&self) -> usize {
        self.splits.len()
    }

    /// Returns a flock, numbered from 0.
    pub fn sequence(&self, number: usize) -> Sequence {
        let split = self.splits[number];
        let sequence = sequence(self, number as u32, split);
        sequence.expect("the ends of all ranges were checked")
    }

    /// Returns the flocks in the order of their numbers.
    pub fn sequences(&self) -> impl Iterator<Item = Sequence> + '_ {
        (0..self.n_flocks()).map(|number| self.sequence(number))
    }

    /// Returns the subset of each flock.
    pub fn split_of_each(&self) -> &[Split] {
        &self.splits
    }

    /// Returns the names of the subsets that have flocks.
    pub fn splits(&self) -> Vec<&'static str> {
        let has = |split: &Split| self.splits.contains(split);
        let splits = Split::ALL.into_iter().filter(has);
        splits.map(Split::name).collect()
    }
}

impl Sequence {
    /// Returns the name of the flock in paths. It starts with a letter, because readers of tables take a name of
    /// digits for a number.
    pub fn name(&self) -> String {
        format!("flock{:05}", self.number)
    }
}

/// Returns the subset of each flock. The flocks are shuffled; the first go to val, the next to test.
fn splits(params: &Params) -> Vec<Split> {
    let n = params.flocks;
    let mut order: Vec<u32> = (0..n).collect();
    order.sort_by_key(|&number| {
        let seed = params.seed;
        (Dice { seed, number }.bits(Choice::Split, 0), number)
    });
    // A subset with a share has at least one flock, as long as there are three.
    let share = |share: f64| match (share * f64::from(n)).round() as u32 {
        0 if share > 0.0 && n >= 3 => 1,
        most => most.min(n),
    };
    let n_val = share(params.split[1]);
    let n_test = share(params.split[2]).min(n - n_val);
    let mut splits = vec![Split::Train; n as usize];
    for (k, number) in (0u32..).zip(order) {
        if k < n_val {
            splits[number as usize] = Split::Val;
        } else if k < n_val + n_test {
            splits[number as usize] = Split::Test;
        }
    }
    splits
}

fn sequence(plan: &Plan, number: u32, split: Split) -> Result<Sequence, Error> {
    let (params, n_libraries) = (&plan.params, plan.sizes_px.len() as u64);
    let seed = params.seed;
    let dice = Dice { seed, number };
    // One library after the other, from a random one on, so that all are used alike.
    let first = Dice { seed, number: 0 }.bits(Choice::Library, 0) % n_libraries;
    let library = ((first + u64::from(number)) % n_libraries) as usize;
    let preset = &params.presets[dice.pick(Choice::Preset, params.presets.len())];
    let count = dice.whole(Choice::Count, params.count.map(f64::from));
    let scale = dice.uniform(Choice::Scale, params.scale);
    let size_px = scaled(plan.sizes_px[library], scale);
    // Numbers above 2^53 are not exact in JSON files.
    let seed = dice.bits(Choice::Seed, 0) >> 11;
    let mut flock = flock(params, preset, count, seed, size_px)?;
    flock.render.haze_per_bl = dice.uniform(Choice::Haze, params.haze_per_bl);
    flock.render.shadow = (params.shadow).map(|range| dice.uniform(Choice::Shadow, range));
    let (ground, background) = ground(params, &dice, plan.n_pictures);
    flock.render.background = background;
    Ok(Sequence {
        number,
        split,
        library,
        preset: preset.clone(),
        params: checked(flock)?,
        ground,
        look: look(params, &dice),
    })
}

/// Returns the parameters of a flock, without what is drawn of its scene.
fn flock(
    params: &Params,
    preset: &str,
    count: u32,
    seed: u64,
    size_px: [u32; 2],
) -> Result<flock::Params, Error> {
    let mut overrides: Map<String, Value> = params.flock.clone();
    let drawn = [
        ("preset", Value::from(preset)),
        ("count", Value::from(count)),
        (
            "frames",
            Value::from((params.pictures - 1) * params.every + 1),
        ),
        ("seed", Value::from(seed)),
    ];
    overrides.extend(drawn.map(|(name, value)| (name.to_owned(), value)));
    let mut flock: flock::Params = params::read(overrides)?;
    flock.render.size_px = Some(params.size_px.unwrap_or(size_px));
    Ok(flock)
}

/// Returns a size times a factor, at least what a video may have.
fn scaled(size_px: [u32; 2], scale: f64) -> [u32; 2] {
    size_px.map(|side| (f64::from(side) * scale).round().max(16.0) as u32)
}

fn checked(flock: flock::Params) -> Result<flock::Params, Error> {
    let result = crate::parameters::Parameters::check(&flock);
    result.map_err(Error::Invalid).map(|()| flock)
}

fn ground(params: &Params, dice: &Dice, n_pictures: usize) -> (Ground, Background) {
    let weights = &params.backgrounds;
    let picture = if n_pictures > 0 { weights.picture } else { 0.0 };
    let all = weights.plate + weights.color + picture;
    let at = dice.uniform(Choice::Background, [0.0, all]);
    if at < picture {
        let picture = dice.pick(Choice::Picture, n_pictures);
        return (Ground::Picture(picture), Background::Plate);
    }
    if at < picture + weights.color {
        let color = [0, 1, 2].map(|k| (dice.bits(Choice::Color, k) >> 56) as u8);
        return (Ground::FromParams, Background::Color(color));
    }
    (Ground::FromParams, Background::Plate)
}

fn look(params: &Params, dice: &Dice) -> Look {
    let gain = dice.factor(Choice::Gain, 0, params.gain);
    let quality = params.jpeg_quality.map(f64::from);
    Look {
        gain: [1, 2, 3].map(|k| gain * dice.factor(Choice::Gain, k, params.color_gain)),
        blur_px: dice.uniform(Choice::Blur, params.blur_px),
        noise: dice.uniform(Choice::Noise, params.noise),
        jpeg_quality: dice.whole(Choice::Quality, quality) as u8,
        seed: dice.bits(Choice::NoiseSeed, 0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(params: &Params) -> Plan {
        Plan::new(params, &[[640, 480], [320, 240]], 3).expect("good parameters")
    }

    fn params(flocks: u32) -> Params {
        Params {
            flocks,
            shadow: Some([0.1, 0.3]),
            ..Params::default()
        }
    }

    #[test]
    fn values_lie_in_their_ranges_and_reach_both_ends() {
        let params = params(400);
        let plan = plan(&params);
        let all = |of: &dyn Fn(&Sequence) -> f64, [low, high]: [f64; 2]| {
            let values: Vec<f64> = plan.sequences().map(|one| of(&one)).collect();
            let (min, max) = values
                .iter()
                .fold((f64::MAX, f64::MIN), |(min, max), &value| {
                    (min.min(value), max.max(value))
                });
            let reach = 0.06 * (high - low);
            assert!(low <= min && min < low + reach, "{min} {low}");
            assert!(high - reach < max && max <= high, "{max} {high}");
        };
        all(&|one| f64::from(one.params.count.unwrap_or(0)), [2.0, 20.0]);
        all(&|one| one.look.noise, params.noise);
        all(&|one| one.look.blur_px, params.blur_px);
        all(&|one| f64::from(one.look.jpeg_quality), [70.0, 95.0]);
        all(&|one| one.params.render.haze_per_bl, params.haze_per_bl);
        all(&|one| one.params.render.shadow.unwrap_or(9.0), [0.1, 0.3]);
        let of = |is: &dyn Fn(&Sequence) -> bool| plan.sequences().filter(|one| is(one)).count();
        assert_eq!(of(&|one| one.library == 0), 200);
        let n_pictures = of(&|one| one.ground != Ground::FromParams);
        assert!((150..220).contains(&n_pictures), "{n_pictures}");
        let is_color =
            |one: &Sequence| matches!(one.params.render.background, Background::Color(_));
        let n_colors = of(&is_color);
        assert!((20..60).contains(&n_colors), "{n_colors}");
    }

    #[test]
    fn values_of_a_flock_are_independent() {
        let params = params(400);
        let plan = plan(&params);
        let shares = |of: &dyn Fn(&Sequence) -> f64, [low, high]: [f64; 2]| -> Vec<f64> {
            let share = |one| (of(&one) - low) / (high - low) - 0.5;
            plan.sequences().map(share).collect()
        };
        let all = [
            shares(&|one| one.look.noise, params.noise),
            shares(&|one| one.look.blur_px, params.blur_px),
            shares(&|one| one.params.render.haze_per_bl, params.haze_per_bl),
            shares(&|one| one.params.render.shadow.unwrap_or(9.0), [0.1, 0.3]),
        ];
        for (a, first) in all.iter().enumerate() {
            for second in &all[a + 1..] {
                let products = first.iter().zip(second).map(|(a, b)| 12.0 * a * b);
                let correlation = products.sum::<f64>() / first.len() as f64;
                assert!(correlation.abs() < 0.25, "{correlation}");
            }
        }
    }

    #[test]
    fn each_flock_has_one_split_and_the_shares_hold() {
        let count = |flocks, split| {
            let plan = plan(&params(flocks));
            plan.sequences().filter(|one| one.split == split).count()
        };
        assert_eq!(Split::ALL.map(|split| count(40, split)), [32, 4, 4]);
        assert_eq!(Split::ALL.map(|split| count(4, split)), [2, 1, 1]);
        assert_eq!(Split::ALL.map(|split| count(1, split)), [1, 0, 0]);
    }

    #[test]
    fn parameters_that_are_wrong_for_some_flocks_are_refused() {
        let too_many = Params {
            count: [1, 1000],
            pictures: 5000,
            ..Params::default()
        };
        assert!(Plan::new(&too_many, &[[640, 480]], 0).is_err());
        let too_large = Params {
            scale: [0.1, 4.0],
            ..Params::default()
        };
        assert!(Plan::new(&too_large, &[[64, 48], [1920, 1080]], 0).is_err());
        assert!(Plan::new(&too_large, &[[64, 48]], 0).is_ok());
    }

    #[test]
    fn a_flock_depends_on_the_seed_and_on_its_number_only() {
        let (few, many) = (plan(&params(10)), plan(&params(40)));
        for (a, b) in few.sequences().zip(many.sequences()) {
            assert_eq!((&a.params, a.look, a.ground), (&b.params, b.look, b.ground));
        }
        let other = Params {
            seed: 2,
            ..params(10)
        };
        assert!(plan(&other).sequence(0).params.seed != few.sequence(0).params.seed);
    }
}
