//! The packets of tev's network protocol that a render needs. Little-endian; a packet begins with its length, itself included,
//! and its kind; texts end with a zero. [tev's `Ipc.h`]

/// Kinds of packets.
const CREATE_IMAGE: u8 = 4;
const UPDATE_IMAGE_V3: u8 = 6;

const CHANNELS: [&str; 3] = ["R", "G", "B"];

/// A picture as tev knows it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ImageInfo {
    /// By this the viewer tells pictures apart; a picture that is created takes the place of one with its name.
    pub name: String,
    pub width: u32,
    pub height: u32,
}

/// Puts a black picture in front of the viewer.
pub fn create(image: &ImageInfo) -> Vec<u8> {
    let mut packet = Packet::new(CREATE_IMAGE);
    packet.flag(true);
    packet.texts(&[&image.name]);
    packet.numbers(&[image.width, image.height, CHANNELS.len() as u32]);
    packet.texts(&CHANNELS);
    packet.finish()
}

/// Replaces `rows` rows from row `first` on; `pixels` are theirs, from left to right.
pub fn update(image: &ImageInfo, first: u32, rows: u32, pixels: &[[f32; 3]]) -> Vec<u8> {
    let mut packet = Packet::new(UPDATE_IMAGE_V3);
    packet.flag(false);
    packet.texts(&[&image.name]);
    packet.numbers(&[CHANNELS.len() as u32]);
    packet.texts(&CHANNELS);
    packet.numbers(&[0, first, image.width, rows]);
    // Where each channel's first value is among all values, and how far apart its values are.
    packet.longs(&[0, 1, 2]);
    packet.longs(&[CHANNELS.len() as i64; 3]);
    packet.values(pixels.as_flattened());
    packet.finish()
}

struct Packet(Vec<u8>);

impl Packet {
    fn new(kind: u8) -> Self {
        Packet(vec![0, 0, 0, 0, kind])
    }

    fn flag(&mut self, flag: bool) {
        self.0.push(flag.into());
    }

    fn texts(&mut self, texts: &[&str]) {
        for text in texts {
            self.0.extend(text.bytes().filter(|&byte| byte != 0));
            self.0.push(0);
        }
    }

    fn numbers(&mut self, numbers: &[u32]) {
        self.0.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
    }

    fn longs(&mut self, numbers: &[i64]) {
        self.0.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
    }

    fn values(&mut self, values: &[f32]) {
        self.0.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    }

    fn finish(mut self) -> Vec<u8> {
        let length = self.0.len() as u32;
        self.0[..4].copy_from_slice(&length.to_le_bytes());
        self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image() -> ImageInfo {
        ImageInfo { name: "a.exr".to_owned(), width: 2, height: 3 }
    }

    /// Written out by hand from the viewer's own reader.
    #[test]
    fn a_picture_is_created() {
        let expected: &[&[u8]] = &[
            &[30, 0, 0, 0], // length
            &[4],           // CreateImage
            &[1],           // grabs the focus
            b"a.exr\0",     //
            &[2, 0, 0, 0],  // width
            &[3, 0, 0, 0],  // height
            &[3, 0, 0, 0],  // channels
            b"R\0",
            b"G\0",
            b"B\0", //
        ];
        assert_eq!(create(&image()), expected.concat());
    }

    #[test]
    fn rows_are_replaced() {
        let pixels = [[1.0, -2.0, 0.5], [0.0, 1.5, 3.0]];
        let expected: &[&[u8]] = &[
            &[110, 0, 0, 0], // length
            &[6],            // UpdateImageV3
            &[0],            // leaves the focus
            b"a.exr\0",      //
            &[3, 0, 0, 0],   // channels
            b"R\0",
            b"G\0",
            b"B\0",                    //
            &[0, 0, 0, 0],             // x
            &[1, 0, 0, 0],             // y
            &[2, 0, 0, 0],             // width
            &[1, 0, 0, 0],             // height
            &[0, 0, 0, 0, 0, 0, 0, 0], // offsets
            &[1, 0, 0, 0, 0, 0, 0, 0],
            &[2, 0, 0, 0, 0, 0, 0, 0],
            &[3, 0, 0, 0, 0, 0, 0, 0], // strides
            &[3, 0, 0, 0, 0, 0, 0, 0],
            &[3, 0, 0, 0, 0, 0, 0, 0],
            &[0x00, 0x00, 0x80, 0x3f], // 1
            &[0x00, 0x00, 0x00, 0xc0], // -2
            &[0x00, 0x00, 0x00, 0x3f], // 0.5
            &[0x00, 0x00, 0x00, 0x00], // 0
            &[0x00, 0x00, 0xc0, 0x3f], // 1.5
            &[0x00, 0x00, 0x40, 0x40], // 3
        ];
        assert_eq!(update(&image(), 1, 1, &pixels), expected.concat());
    }

    /// A zero would end the name early, and what follows would be read as numbers.
    #[test]
    fn a_zero_in_a_name_is_left_out() {
        let image = ImageInfo { name: "a\0b".to_owned(), ..image() };
        assert_eq!(&create(&image)[6..9], b"ab\0");
    }
}
