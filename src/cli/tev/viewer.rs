//! The connection to a viewer, on a thread of its own: however slow the viewer is, the render goes on.

use super::packet::{self, ImageInfo};
use std::io::{self, ErrorKind, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::str::FromStr;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// How long a viewer may take to answer a connection, and to take a packet.
const PATIENCE: Duration = Duration::from_secs(5);
/// Between two tries to reach a viewer that went away.
const BETWEEN_TRIES: Duration = Duration::from_secs(1);
/// How long the end of a render waits for its picture to be taken.
const FAREWELL: Duration = Duration::from_secs(5);
/// Values of a packet at most, so that no packet is longer than its length can say.
const VALUES_PER_PACKET: usize = 1 << 24;

/// Where a viewer listens.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Address {
    /// `HOST:PORT`, as it was given.
    text: String,
}

/// What cannot be an address, or where no viewer is.
#[derive(Debug, thiserror::Error)]
pub enum AddressError {
    #[error("\"{0}\" is no address; write HOST:PORT, such as localhost:14158, where tev listens by default")]
    Malformed(String),
    #[error(
        "no viewer answers at {address}; start tev (it listens at 127.0.0.1:14158, or where its --host says), or leave out --tev"
    )]
    Absent { address: String, source: io::Error },
}

impl FromStr for Address {
    type Err = AddressError;
    fn from_str(text: &str) -> Result<Self, AddressError> {
        let is_address = text.rsplit_once(':').is_some_and(|(host, port)| {
            !host.is_empty() && port.parse::<u16>().is_ok_and(|port| port > 0)
        });
        if is_address {
            Ok(Address { text: text.to_owned() })
        } else {
            Err(AddressError::Malformed(text.to_owned()))
        }
    }
}

impl Address {
    fn connect(&self) -> io::Result<TcpStream> {
        let mut last = io::Error::new(ErrorKind::NotFound, "the host has no address");
        for address in self.text.to_socket_addrs()? {
            match TcpStream::connect_timeout(&address, PATIENCE) {
                Ok(stream) => {
                    stream.set_write_timeout(Some(PATIENCE))?;
                    stream.set_nodelay(true)?;
                    return Ok(stream);
                }
                Err(error) => last = error,
            }
        }
        Err(last)
    }
}

type Picture = Vec<[f32; 3]>;

/// What the render and the viewer's thread tell each other.
#[derive(Default)]
struct Desk {
    newest: Option<Picture>,
    /// No picture is on its way, and the viewer may be there.
    is_ready: bool,
    is_over: bool,
    /// The thread has nothing more to do.
    is_done: bool,
}

#[derive(Default)]
struct Shared {
    desk: Mutex<Desk>,
    changed: Condvar,
}

impl Shared {
    fn desk(&self) -> MutexGuard<'_, Desk> {
        self.desk.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A viewer that shows one picture.
pub struct Viewer {
    shared: Arc<Shared>,
    address: Address,
}

impl Viewer {
    /// Connects and shows a black picture. `say` gets lines for the user, from another thread.
    pub fn open(
        address: &Address,
        image: ImageInfo,
        say: impl Fn(&str) + Send + 'static,
    ) -> Result<Self, AddressError> {
        let absent = |source| AddressError::Absent { address: address.text.clone(), source };
        let mut stream = address.connect().map_err(absent)?;
        stream.write_all(&packet::create(&image)).map_err(absent)?;
        let shared = Arc::new(Shared::default());
        let line = Line { address: address.clone(), image, stream: Some(stream), last_try: None };
        let theirs = shared.clone();
        std::thread::spawn(move || serve(line, &theirs, &say));
        Ok(Viewer { shared, address: address.clone() })
    }

    /// Whether a picture would be sent at once; otherwise it is not worth making.
    pub fn is_ready(&self) -> bool {
        let desk = self.shared.desk();
        desk.is_ready && desk.newest.is_none()
    }

    /// Hands a picture over, in place of one that was not sent yet.
    pub fn show(&self, pixels: Picture) {
        self.shared.desk().newest = Some(pixels);
        self.shared.changed.notify_all();
    }

    /// Waits until the last picture was sent, but not for a viewer that does not take it.
    pub fn close(self) -> Result<(), String> {
        let mut desk = self.shared.desk();
        desk.is_over = true;
        self.shared.changed.notify_all();
        let end = Instant::now() + FAREWELL;
        while !desk.is_done {
            let left = end.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Err(format!(
                    "the viewer at {} did not take the last picture",
                    self.address.text
                ));
            }
            let waited = self.shared.changed.wait_timeout(desk, left);
            desk = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
        Ok(())
    }
}

/// A connection that may be broken.
struct Line {
    address: Address,
    image: ImageInfo,
    /// None where the viewer has gone.
    stream: Option<TcpStream>,
    last_try: Option<Instant>,
}

/// Sends pictures until the render is over.
fn serve(mut line: Line, shared: &Shared, say: &dyn Fn(&str)) {
    let mut desk = shared.desk();
    loop {
        desk.is_ready = line.may_be_there();
        let picture = desk.newest.take();
        if picture.is_none() && desk.is_over {
            break;
        }
        desk.is_ready &= picture.is_none();
        match picture {
            Some(pixels) => {
                drop(desk);
                line.send(&pixels, say);
                desk = shared.desk();
            }
            None => {
                let waited = shared.changed.wait_timeout(desk, BETWEEN_TRIES);
                desk = waited.unwrap_or_else(PoisonError::into_inner).0;
            }
        }
    }
    desk.is_done = true;
    shared.changed.notify_all();
}

impl Line {
    /// Whether it is worth a try.
    fn may_be_there(&self) -> bool {
        self.stream.is_some() || self.last_try.is_none_or(|last| last.elapsed() >= BETWEEN_TRIES)
    }

    /// Sends a picture, over a new connection if the old one is broken, and tells when the viewer goes and comes back.
    fn send(&mut self, pixels: &[[f32; 3]], say: &dyn Fn(&str)) {
        let was_there = self.stream.is_some();
        let sent = self.try_send(pixels);
        let Address { text } = &self.address;
        match sent {
            Ok(()) if !was_there => say(&format!("note: the viewer at {text} is back")),
            Ok(()) => {}
            Err(error) => {
                self.stream = None;
                self.last_try = Some(Instant::now());
                if was_there {
                    say(&format!(
                        "warning: the viewer at {text} has gone ({error}); the render goes on, and shows \
                         its pictures if it comes back"
                    ));
                }
            }
        }
    }

    fn try_send(&mut self, pixels: &[[f32; 3]]) -> io::Result<()> {
        let mut stream = match self.stream.take() {
            Some(stream) => stream,
            None => {
                let mut stream = self.address.connect()?;
                stream.write_all(&packet::create(&self.image))?;
                stream
            }
        };
        check_open(&stream)?;
        let width = self.image.width.max(1) as usize;
        let rows = (VALUES_PER_PACKET / 3 / width).max(1);
        for (number, part) in pixels.chunks(rows * width).enumerate() {
            let (first, count) = (number * rows, part.len() / width);
            stream.write_all(&packet::update(&self.image, first as u32, count as u32, part))?;
        }
        self.stream = Some(stream);
        Ok(())
    }
}

/// Whether the other side has closed the connection, which the first write after that does not tell.
fn check_open(stream: &TcpStream) -> io::Result<()> {
    stream.set_nonblocking(true)?;
    let peeked = stream.peek(&mut [0]);
    stream.set_nonblocking(false)?;
    match peeked {
        Ok(0) => Err(io::Error::new(ErrorKind::ConnectionAborted, "it closed the connection")),
        Ok(_) => Ok(()),
        Err(error) if error.kind() == ErrorKind::WouldBlock => Ok(()),
        Err(error) => Err(error),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;
    use std::net::TcpListener;
    use std::sync::mpsc;

    fn image() -> ImageInfo {
        ImageInfo { name: "a.exr".to_owned(), width: 2, height: 2 }
    }

    fn picture(value: f32) -> Picture {
        vec![[value, 2.0 * value, 3.0 * value]; 4]
    }

    fn listener() -> (TcpListener, Address) {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap().to_string().parse().unwrap();
        (listener, address)
    }

    fn read_packet(stream: &mut TcpStream) -> Vec<u8> {
        let mut packet = vec![0; 4];
        stream.read_exact(&mut packet).unwrap();
        let length = u32::from_le_bytes(packet[..4].try_into().unwrap());
        packet.resize(length as usize, 0);
        stream.read_exact(&mut packet[4..]).unwrap();
        packet
    }

    fn wait_until_ready(viewer: &Viewer) {
        let start = Instant::now();
        while !viewer.is_ready() {
            assert!(start.elapsed() < 4 * PATIENCE, "the viewer is never ready");
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    #[test]
    fn addresses_have_a_host_and_a_port() {
        for text in ["localhost:14158", "10.0.0.1:1", "[::1]:14158"] {
            assert!(text.parse::<Address>().is_ok(), "{text}");
        }
        for text in
            ["localhost", "localhost:", ":14158", "localhost:tev", "host:70000", "host:0", ""]
        {
            let error = text.parse::<Address>().unwrap_err().to_string();
            assert!(error.contains("HOST:PORT"), "{error}");
        }
    }

    #[test]
    fn a_viewer_gets_the_picture_created_and_updated() {
        let (listener, address) = listener();
        let viewer = Viewer::open(&address, image(), |line| panic!("{line}")).unwrap();
        let (mut stream, _) = listener.accept().unwrap();
        assert_eq!(read_packet(&mut stream), packet::create(&image()));
        for value in [0.5, 1.5] {
            wait_until_ready(&viewer);
            viewer.show(picture(value));
            let expected = packet::update(&image(), 0, 2, &picture(value));
            assert_eq!(read_packet(&mut stream), expected);
        }
        viewer.show(picture(4.0));
        viewer.close().unwrap();
        assert_eq!(read_packet(&mut stream), packet::update(&image(), 0, 2, &picture(4.0)));
    }

    #[test]
    fn a_viewer_that_is_not_there_is_an_error() {
        let (listener, address) = listener();
        drop(listener);
        let error = Viewer::open(&address, image(), |_| {}).err().unwrap().to_string();
        assert!(error.contains(&address.text) && error.contains("start tev"), "{error}");
    }

    /// The first is told when it goes, the second when it comes; between them nothing is told again.
    #[test]
    fn a_viewer_may_go_and_come_back() {
        let (listener, address) = listener();
        let (lines, told) = mpsc::channel();
        let viewer =
            Viewer::open(&address, image(), move |line| lines.send(line.to_owned()).unwrap())
                .unwrap();
        drop(listener.accept().unwrap());
        drop(listener);
        for _ in 0..3 {
            wait_until_ready(&viewer);
            viewer.show(picture(1.0));
        }
        let line = told.recv_timeout(4 * PATIENCE).unwrap();
        assert!(line.starts_with("warning: ") && line.contains("has gone"), "{line}");
        let listener = TcpListener::bind(&address.text).unwrap();
        wait_until_ready(&viewer);
        viewer.show(picture(2.0));
        let (mut stream, _) = listener.accept().unwrap();
        assert_eq!(read_packet(&mut stream), packet::create(&image()));
        let update = read_packet(&mut stream);
        assert_eq!(update.len(), packet::update(&image(), 0, 2, &picture(2.0)).len());
        let line = told.recv_timeout(4 * PATIENCE).unwrap();
        assert!(line.contains("is back"), "{line}");
        viewer.close().unwrap();
    }

    /// It takes nothing: what is handed over replaces what waits, and nobody waits for it.
    #[test]
    fn a_viewer_that_reads_nothing_holds_nobody_up() {
        let (listener, address) = listener();
        let image = ImageInfo { width: 1 << 12, height: 1 << 10, ..image() };
        let large = vec![[1.0; 3]; 1 << 22];
        let viewer = Viewer::open(&address, image, |_| {}).unwrap();
        let (_held, _) = listener.accept().unwrap();
        let start = Instant::now();
        for _ in 0..8 {
            viewer.show(large.clone());
        }
        assert!(start.elapsed() < PATIENCE / 2, "{:?}", start.elapsed());
    }

    /// A picture of more values than a packet holds comes in strips.
    #[test]
    fn large_pictures_come_in_strips() {
        let (listener, address) = listener();
        let image = ImageInfo { width: 1 << 12, height: 2000, ..image() };
        let viewer = Viewer::open(&address, image.clone(), |_| {}).unwrap();
        let (mut stream, _) = listener.accept().unwrap();
        viewer.show(vec![[1.0, 2.0, 3.0]; (image.width * image.height) as usize]);
        assert_eq!(read_packet(&mut stream), packet::create(&image));
        let rows = VALUES_PER_PACKET / 3 / image.width as usize;
        let (first, second) = (read_packet(&mut stream), read_packet(&mut stream));
        // Before the values: 4 of length, 2, the name, 4, 6 of channels, 16 of the place, 48 of the layout.
        let values = 4 + 2 + image.name.len() + 1 + 4 + 6 + 16 + 48;
        assert_eq!(first.len() - values, rows * image.width as usize * 12);
        assert_eq!(
            second.len() - values,
            (image.height as usize - rows) * image.width as usize * 12
        );
        viewer.close().unwrap();
    }
}
