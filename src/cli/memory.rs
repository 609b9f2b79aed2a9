//! The memory that this process holds, as Linux reports it; None elsewhere.

/// Most resident memory [bytes] since the start or the last [`forget_peak`].
pub fn peak() -> Option<u64> {
    read("VmHWM:")
}

/// Resident memory [bytes] now.
pub fn resident() -> Option<u64> {
    read("VmRSS:")
}

/// Lets [`peak`] start anew, where the system allows that.
pub fn forget_peak() {
    // proc(5): 5 resets the peak to the present resident memory.
    let _ = std::fs::write("/proc/self/clear_refs", "5");
}

/// Memory from a moment on.
pub struct Watch {
    resident: Option<u64>,
    peak: Option<u64>,
}

impl Watch {
    pub fn begin() -> Self {
        let watch = Watch { resident: resident(), peak: peak() };
        forget_peak();
        watch
    }

    /// Most resident memory [bytes] since the start of the process.
    pub fn peak(&self) -> Option<u64> {
        self.peak.max(peak())
    }

    /// Most resident memory [bytes] on top of what there was in the beginning.
    pub fn growth(&self) -> Option<u64> {
        Some(peak()?.saturating_sub(self.resident?))
    }
}

fn read(field: &str) -> Option<u64> {
    parse(&std::fs::read_to_string("/proc/self/status").ok()?, field)
}

/// Bytes of a line such as `VmHWM:   123456 kB`.
fn parse(status: &str, field: &str) -> Option<u64> {
    let value = status.lines().find_map(|line| line.strip_prefix(field))?;
    let kilobytes: u64 = value.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kilobytes * 1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn watch_sees_what_came_after_its_beginning() {
        let before = vec![1u8; 64 << 20];
        let watch = Watch::begin();
        drop(before);
        let Some(small) = watch.growth() else { return };
        let after = vec![1u8; 96 << 20];
        let grown = watch.growth().unwrap();
        assert!(after.iter().all(|&byte| byte == 1));
        assert!(grown > small + (16 << 20) && watch.peak().unwrap() > 96 << 20, "{small} {grown}");
    }

    #[test]
    fn memory_is_read_from_the_status() {
        let status = "Name:\tvpt\nVmPeak:\t  99 kB\nVmHWM:\t    1234 kB\nVmRSS:\t 5 kB\n";
        assert_eq!(parse(status, "VmHWM:"), Some(1234 * 1024));
        assert_eq!(parse(status, "VmRSS:"), Some(5 * 1024));
        assert_eq!(parse("Name:\tvpt\n", "VmHWM:"), None);
    }
}
