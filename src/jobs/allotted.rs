//! Ids of the things that a request creates. A request with an Idempotency-Key gets a fixed sequence of ids,
//! and the same ids if it is repeated after a crash. Things that it has already created are then found by id
//! and not created twice (docs/explanation/promises.md, "Durable answers").
//!
//! Other code gets new random ids. The sequence is stored in the task, so that it need not be passed through
//! every function between API and queue.

use std::cell::Cell;

use uuid::Uuid;

/// Maximum number of ids in the sequence of a request. Free choice; a power of two, because the lowest bits
/// of an id hold its number.
const MAX: u128 = 16;

tokio::task_local! {
    static ALLOTTED: (Uuid, Cell<u128>);
}

/// Runs a request whose ids derive from `family`, numbered in the order in which the request asks for them.
pub async fn under<F: Future>(family: Uuid, request: F) -> F::Output {
    ALLOTTED.scope((family, Cell::new(0)), request).await
}

/// Returns the next id of the request's sequence. Returns a new id if the request has no sequence or has used
/// it up.
pub fn next_id() -> Uuid {
    let of_family = ALLOTTED.try_with(|(family, n_given)| {
        let n = n_given.replace(n_given.get() + 1);
        (n < MAX).then(|| Uuid::from_u128((family.as_u128() & !(MAX - 1)) | n))
    });
    of_family.ok().flatten().unwrap_or_else(Uuid::now_v7)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn a_family_gives_the_same_ids_in_the_same_order_and_none_twice() {
        let family = Uuid::now_v7();
        let three = || under(family, async { [next_id(), next_id(), next_id()] });
        let ids = three().await;
        assert_eq!(ids, three().await);
        assert!(ids[0] != ids[1] && ids[1] != ids[2] && ids[0] != next_id());
        assert_eq!(ids[0].get_version_num(), 7);
    }
}
