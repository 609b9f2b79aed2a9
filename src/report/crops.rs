//! Where to look closer: the parts of the picture in which the methods go wrong most.

use super::picture::Picture;

/// A part of a picture, in pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Crop {
    pub x: usize,
    pub y: usize,
    pub width: usize,
    pub height: usize,
}

impl Crop {
    /// The part of a shown picture.
    pub fn cut(&self, image: &image::RgbImage) -> image::RgbImage {
        let Crop { x, y, width, height } = *self;
        let view =
            image::imageops::crop_imm(image, x as u32, y as u32, width as u32, height as u32);
        view.to_image()
    }

    fn overlaps(&self, other: &Crop) -> bool {
        self.x < other.x + other.width
            && other.x < self.x + self.width
            && self.y < other.y + other.height
            && other.y < self.y + self.height
    }
}

/// Up to `count` parts of a fifth of the picture's sides, apart from each other, in which the pictures differ
/// most from the reference, relative to it.
pub fn choose(reference: &Picture, pictures: &[&Picture], count: usize) -> Vec<Crop> {
    let [width, height] = reference.size().map(|side| (side / 5).max(1));
    let floor = reference.dark_level();
    let mut candidates: Vec<(f64, Crop)> = Vec::new();
    for y in (0..=reference.height - height).step_by((height / 2).max(1)) {
        for x in (0..=reference.width - width).step_by((width / 2).max(1)) {
            let crop = Crop { x, y, width, height };
            candidates.push((error_in(reference, floor, pictures, &crop), crop));
        }
    }
    candidates.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut chosen: Vec<Crop> = Vec::new();
    for (_, crop) in candidates {
        if chosen.len() < count && !chosen.iter().any(|other| crop.overlaps(other)) {
            chosen.push(crop);
        }
    }
    chosen
}

fn error_in(reference: &Picture, floor: f64, pictures: &[&Picture], crop: &Crop) -> f64 {
    let mut sum = 0.0;
    for y in crop.y..crop.y + crop.height {
        for index in y * reference.width + crop.x..y * reference.width + crop.x + crop.width {
            for (channel, &r) in reference.pixels[index].iter().enumerate() {
                let r = f64::from(r);
                for picture in pictures {
                    let share = (f64::from(picture.pixels[index][channel]) - r) / (r.abs() + floor);
                    // A single bright pixel does not make a part worth seeing.
                    sum += share.abs().min(1.0);
                }
            }
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crops_are_apart_and_start_where_the_error_is() {
        let reference = Picture::from_fn(50, 40, |_, _| [1.0; 3]);
        let bad = Picture::from_fn(50, 40, |x, y| [if x >= 40 && y >= 32 { 3.0 } else { 1.0 }; 3]);
        let crops = choose(&reference, &[&bad], 3);
        assert_eq!(crops.len(), 3);
        assert_eq!(crops[0], Crop { x: 40, y: 32, width: 10, height: 8 });
        assert!(!crops[0].overlaps(&crops[1]) && !crops[1].overlaps(&crops[2]));
    }

    #[test]
    fn tiny_pictures_have_crops_too() {
        let reference = Picture::from_fn(2, 1, |_, _| [1.0; 3]);
        assert_eq!(choose(&reference, &[&reference], 3).len(), 2);
    }
}
