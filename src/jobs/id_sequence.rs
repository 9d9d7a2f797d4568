//! Ids of the things that a request creates. A request with an Idempotency-Key gets a fixed sequence of ids,
//! and the same ids if it is repeated after a crash. Things that it has already created are then found by id
//! and not created twice (docs/explanation/promises.md, "Durable answers").

use uuid::Uuid;

/// Maximum number of derived ids. Free choice; a power of two, because the lowest bits of an id hold its
/// number.
const MAX_DERIVED: u128 = 16;

/// A sequence of ids.
#[derive(Clone, Debug, Default)]
pub struct IdSequence {
    /// Id from which the others derive; `None` for random ids.
    base: Option<Uuid>,
    n_taken: u128,
}

impl IdSequence {
    /// Returns a sequence of new random ids.
    pub fn random() -> IdSequence {
        IdSequence::default()
    }

    /// Returns the sequence that derives from `base`. Ids after the 16th are random.
    pub fn derived_from(base: Uuid) -> IdSequence {
        IdSequence {
            base: Some(base),
            n_taken: 0,
        }
    }

    /// Returns the next id.
    pub fn next_id(&mut self) -> Uuid {
        let number = self.n_taken;
        self.n_taken += 1;
        match self.base {
            Some(base) if number < MAX_DERIVED => {
                Uuid::from_u128((base.as_u128() & !(MAX_DERIVED - 1)) | number)
            }
            _ => Uuid::now_v7(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_base_gives_the_same_distinct_ids_in_the_same_order() {
        let base = Uuid::now_v7();
        let three = || {
            let mut ids = IdSequence::derived_from(base);
            [ids.next_id(), ids.next_id(), ids.next_id()]
        };
        let ids = three();
        assert_eq!(ids, three());
        let random = IdSequence::random().next_id();
        assert!(ids[0] != ids[1] && ids[1] != ids[2] && ids[0] != random);
        assert_eq!(ids[0].get_version_num(), 7);
    }
}
