//! The layers of the sandbox by name, and which of them this machine's kernel has (RELIABILITY.md,
//! "The gate": what the kernel lacks is said). Whether the installed tools can work inside them as
//! well is found out by `tools`.

#![expect(
    unsafe_code,
    reason = "the kernel is asked by system calls that have no safe wrapper"
)]

use super::calls;

/// One wall around a media child.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layer {
    /// It dies with the process that started it, and with the thread's group.
    Leash,
    /// Root's powers are dropped, and none can be had again.
    Privileges,
    /// Bounds on address space, processor time, file size, open files, core dumps.
    Limits,
    /// Landlock: it reads its input and its libraries, writes its output, runs nothing else.
    Files,
    /// Landlock: no TCP connection in or out.
    Network,
    /// Landlock: no signal and no abstract socket to anybody outside.
    Signals,
    /// Seccomp: no sockets, no processes, no other process's memory, no mounts, and so on.
    Calls,
}

impl Layer {
    /// Every layer, in the order in which a child enters them.
    pub const ALL: [Layer; 7] = [
        Layer::Leash,
        Layer::Privileges,
        Layer::Limits,
        Layer::Files,
        Layer::Network,
        Layer::Signals,
        Layer::Calls,
    ];

    /// Its stable name.
    pub fn name(self) -> &'static str {
        match self {
            Layer::Leash => "leash",
            Layer::Privileges => "privileges",
            Layer::Limits => "limits",
            Layer::Files => "files",
            Layer::Network => "network",
            Layer::Signals => "signals",
            Layer::Calls => "calls",
        }
    }

    /// What a film could do where it is missing, in plain words.
    pub fn meaning(self) -> &'static str {
        match self {
            Layer::Leash => "a decoder could go on after flockreel has died",
            Layer::Privileges => "a decoder run by root would have root's powers",
            Layer::Limits => "a film could use up memory, processor or disk",
            Layer::Files => "a film that takes over its decoder could read other files",
            Layer::Network => "a second wall before the network is missing",
            Layer::Signals => "a film that takes over its decoder could stop other processes",
            Layer::Calls => {
                "a film that takes over its decoder could use the network and start programs"
            }
        }
    }
}

/// A set of layers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layers(u8);

impl Layers {
    /// Every layer.
    pub const ALL: Layers = Layers((1 << Layer::ALL.len()) - 1);
    /// No layer at all.
    pub const NONE: Layers = Layers(0);
    /// What every Linux has had for long: `--sandbox off` leaves these.
    pub const OLD: Layers = Layers::NONE
        .with(Layer::Leash)
        .with(Layer::Privileges)
        .with(Layer::Limits);

    /// The same and `layer`.
    #[must_use]
    pub const fn with(self, layer: Layer) -> Layers {
        Layers(self.0 | 1 << layer as u8)
    }

    /// The same without `layer`.
    #[must_use]
    pub const fn without(self, layer: Layer) -> Layers {
        Layers(self.0 & !(1 << layer as u8))
    }

    /// Those in both.
    #[must_use]
    pub const fn and(self, other: Layers) -> Layers {
        Layers(self.0 & other.0)
    }

    /// Whether `layer` is among them.
    pub const fn has(self, layer: Layer) -> bool {
        self.0 & 1 << layer as u8 != 0
    }
}

/// Why the kernel cannot give a layer; `None` where it can.
pub(in crate::media) fn lack_of(layer: Layer) -> Option<String> {
    let landlock = |since: i64, linux: &str| match landlock_abi() {
        Ok(abi) if abi >= since => None,
        Ok(abi) => Some(format!(
            "Landlock {abi} of this kernel is too old: it needs Linux {linux}"
        )),
        Err(errno) => Some(format!("this kernel has no Landlock: {errno}")),
    };
    match layer {
        Layer::Leash | Layer::Privileges | Layer::Limits => None,
        Layer::Files => landlock(1, "5.13"),
        Layer::Network => landlock(4, "6.7"),
        Layer::Signals => landlock(6, "6.12"),
        Layer::Calls => calls::lack(),
    }
}

/// The version of Landlock's interface that the kernel speaks.
pub(in crate::media) fn landlock_abi() -> std::io::Result<i64> {
    const ASK_VERSION: libc::c_ulong = 1;
    let nothing = std::ptr::null::<u8>();
    // SAFETY: with this flag the kernel reads no memory of ours and makes nothing.
    let abi = unsafe {
        libc::syscall(
            libc::SYS_landlock_create_ruleset,
            nothing,
            0usize,
            ASK_VERSION,
        )
    };
    match abi {
        1.. => Ok(abi),
        _ => Err(std::io::Error::last_os_error()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_set_holds_what_was_put_in_and_not_what_was_taken_out() {
        for layer in Layer::ALL {
            assert!(Layers::ALL.has(layer) && !Layers::NONE.has(layer));
            assert!(Layers::NONE.with(layer).has(layer));
            assert!(!Layers::ALL.without(layer).has(layer));
            assert_eq!(Layers::ALL.without(layer).with(layer), Layers::ALL);
        }
    }
}
