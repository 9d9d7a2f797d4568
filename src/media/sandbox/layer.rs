//! The layers of the sandbox, and which of them the kernel of this machine supports
//! (docs/explanation/promises.md, "Sandbox"). `tools` finds out whether the installed tools run inside them.

#![expect(
    unsafe_code,
    reason = "the kernel is asked by system calls that have no safe wrapper"
)]

use serde::{Deserialize, Serialize};

use super::calls;

/// One protection around a media child.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Layer {
    /// The child is killed when the thread that started it ends, and so when flockreel dies.
    Leash,
    /// The capabilities of root are dropped.
    Privileges,
    /// Limits of address space, processor time, file size, open files and core dumps.
    Limits,
    /// Landlock: reads only its input and its libraries, writes only its output, runs no other program.
    Files,
    /// Landlock: no TCP connections in or out.
    Network,
    /// Landlock: no signals and no abstract sockets to processes outside.
    Signals,
    /// Seccomp: no sockets, processes, access to the memory of other processes, mounts and so on.
    Calls,
}

impl Layer {
    /// All layers, in the order in which a child enters them.
    pub const ALL: [Layer; 7] = [
        Layer::Leash,
        Layer::Privileges,
        Layer::Limits,
        Layer::Files,
        Layer::Network,
        Layer::Signals,
        Layer::Calls,
    ];

    /// Returns the stable name.
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

    /// Returns what a malicious film could do without the layer.
    pub fn meaning(self) -> &'static str {
        match self {
            Layer::Leash => "without this layer, a decoder could outlive flockreel",
            Layer::Privileges => {
                "without this layer, a decoder started by root would have root's privileges"
            }
            Layer::Limits => "a film could use up memory, processor or disk",
            Layer::Files => "a film that takes over its decoder could read other files",
            Layer::Network => "without this layer, only the layer `calls` blocks the network",
            Layer::Signals => "a film that takes over its decoder could stop other processes",
            Layer::Calls => {
                "a film that takes over its decoder could use the network and start programs"
            }
        }
    }
}

/// A set of layers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Layers(u8);

impl Layers {
    /// All layers.
    pub const ALL: Layers = Layers((1 << Layer::ALL.len()) - 1);
    /// No layers.
    pub const NONE: Layers = Layers(0);
    /// Layers that every common Linux supports. `--sandbox off` uses only these.
    pub const BASIC: Layers = Layers::NONE
        .with(Layer::Leash)
        .with(Layer::Privileges)
        .with(Layer::Limits);

    /// Returns the set with `layer` added.
    #[must_use]
    pub const fn with(self, layer: Layer) -> Layers {
        Layers(self.0 | 1 << layer as u8)
    }

    /// Returns the set without `layer`.
    #[must_use]
    pub const fn without(self, layer: Layer) -> Layers {
        Layers(self.0 & !(1 << layer as u8))
    }

    /// Returns the layers in both sets.
    #[must_use]
    pub const fn and(self, other: Layers) -> Layers {
        Layers(self.0 & other.0)
    }

    /// Returns whether the set contains `layer`.
    pub const fn has(self, layer: Layer) -> bool {
        self.0 & 1 << layer as u8 != 0
    }
}

/// Returns why the kernel does not support a layer; `None` if it does.
pub(in crate::media) fn unsupported_reason(layer: Layer) -> Option<String> {
    let landlock = |since: i64, linux: &str| match landlock_abi() {
        Ok(abi) if abi >= since => None,
        Ok(abi) => Some(format!(
            "this kernel has Landlock {abi}, which is too old: the layer needs Linux {linux}"
        )),
        Err(errno) => Some(format!("this kernel has no Landlock: {errno}")),
    };
    match layer {
        Layer::Leash | Layer::Privileges | Layer::Limits => None,
        Layer::Files => landlock(1, "5.13"),
        Layer::Network => landlock(4, "6.7"),
        Layer::Signals => landlock(6, "6.12"),
        Layer::Calls => calls::unsupported_reason(),
    }
}

/// Returns the Landlock ABI version of the kernel.
pub(in crate::media) fn landlock_abi() -> std::io::Result<i64> {
    const GET_VERSION: libc::c_ulong = 1;
    let nothing = std::ptr::null::<u8>();
    // SAFETY: with this flag the kernel reads no memory of this process and creates nothing.
    let abi = unsafe {
        libc::syscall(
            libc::SYS_landlock_create_ruleset,
            nothing,
            0usize,
            GET_VERSION,
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
    fn set_contains_added_layers_and_not_removed_ones() {
        for layer in Layer::ALL {
            assert!(Layers::ALL.has(layer) && !Layers::NONE.has(layer));
            assert!(Layers::NONE.with(layer).has(layer));
            assert!(!Layers::ALL.without(layer).has(layer));
            assert_eq!(Layers::ALL.without(layer).with(layer), Layers::ALL);
        }
    }
}
