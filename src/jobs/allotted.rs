//! The ids under which a request makes things (RELIABILITY.md, store and queue rules: Idempotency-Key).
//! A request with a key has them allotted before it runs, and the same ones when it comes again after
//! a crash: then what is there already is found under its id and not made twice. Any other code gets
//! fresh ids. They belong to the task, so that no function between the door and the queue knows of them.

use std::cell::Cell;

use uuid::Uuid;

/// How many ids one request may ask for.
const MAX: u128 = 16;

tokio::task_local! {
    static ALLOTTED: (Uuid, Cell<u128>);
}

/// Runs a request whose things have ids of this family, in the order in which it asks for them.
pub async fn under<F: Future>(family: Uuid, request: F) -> F::Output {
    ALLOTTED.scope((family, Cell::new(0)), request).await
}

/// The next id: of the request's family, if it has one.
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
