//! The order of an EXR header's attributes: by name, as OpenEXR writes them. The crate `exr` keeps them in a hash map, and files of
//! the same picture would differ.

/// Behind the magic number and the version.
const FIRST_ATTRIBUTE: usize = 8;

/// Sorts the attributes of a file of one part. No offset changes: the header is as long as before.
pub fn sort_attributes(file: &mut [u8]) -> Option<()> {
    let mut attributes = Vec::new();
    let mut start = FIRST_ATTRIBUTE;
    while *file.get(start)? != 0 {
        let end = end_of_attribute(file, start)?;
        attributes.push(file.get(start..end)?.to_vec());
        start = end;
    }
    attributes.sort_by(|a, b| name(a).cmp(name(b)));
    file[FIRST_ATTRIBUTE..start].copy_from_slice(&attributes.concat());
    Some(())
}

/// Name and type end with a zero; four bytes of length and the value follow.
fn end_of_attribute(file: &[u8], start: usize) -> Option<usize> {
    let behind_text = |from: usize| Some(from + name(file.get(from..)?).len() + 1);
    let length = behind_text(behind_text(start)?)?;
    let bytes = file.get(length..length + 4)?.try_into().ok()?;
    (length + 4).checked_add(u32::from_le_bytes(bytes) as usize)
}

fn name(attribute: &[u8]) -> &[u8] {
    attribute.split(|&byte| byte == 0).next().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn attribute(name: &str, value: &[u8]) -> Vec<u8> {
        let length = (value.len() as u32).to_le_bytes();
        [name.as_bytes(), b"\0string\0", &length, value].concat()
    }

    #[test]
    fn attributes_are_sorted_and_the_rest_stays() {
        let [a, b] = [attribute("b", b"\0\0one"), attribute("a", b"another")];
        let rest = b"\0pixels\0".as_slice();
        let mut file = [b"magicver".as_slice(), &a, &b, rest].concat();
        sort_attributes(&mut file).unwrap();
        assert_eq!(file, [b"magicver".as_slice(), &b, &a, rest].concat());
    }

    #[test]
    fn a_file_that_ends_early_is_left_alone() {
        let whole =
            [b"magicver".as_slice(), &attribute("b", b"one"), &attribute("a", b"two")].concat();
        for length in 0..whole.len() {
            let mut file = whole[..length].to_vec();
            assert_eq!(sort_attributes(&mut file), None);
            assert_eq!(file, whole[..length]);
        }
    }
}
