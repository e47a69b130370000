//! Files that appear whole or not at all.

use std::cell::Cell;
use std::fs::File;
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::Path;
use std::rc::Rc;

use crate::{BakeError, Progress};

/// Bytes gathered before the system is asked to write them.
const BUFFER: usize = 1 << 18;

/// A file that is being written. It keeps what the system said, which encoders turn into their own
/// errors, and fails once the caller wants to stop.
pub(crate) struct Guarded<'a, 'p> {
    file: BufWriter<&'a File>,
    progress: &'a mut Progress<'p>,
    failure: Option<io::Error>,
    stopped: bool,
    since: usize,
    rows: Rc<Cell<(usize, usize)>>,
}

impl Guarded<'_, '_> {
    fn keep<T>(&mut self, result: io::Result<T>) -> io::Result<T> {
        result.map_err(|error| {
            let copy = error.raw_os_error().map_or_else(|| error.kind().into(), io::Error::from_raw_os_error);
            self.failure.get_or_insert(error);
            copy
        })
    }

    /// What the next report says: rows done and their number.
    pub fn rows(&self) -> Rc<Cell<(usize, usize)>> {
        Rc::clone(&self.rows)
    }
}

impl Write for Guarded<'_, '_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.since += bytes.len();
        if self.since >= BUFFER {
            self.since = 0;
            let (done, total) = self.rows.get();
            let answer = if total > 0 { self.progress.report(done, total) } else { self.progress.check() };
            self.stopped |= answer.is_err();
        }
        if self.stopped {
            return Err(io::Error::other("stopped by the caller"));
        }
        let result = self.file.write(bytes);
        self.keep(result)
    }

    fn flush(&mut self) -> io::Result<()> {
        let result = self.file.flush();
        self.keep(result)
    }
}

impl Seek for Guarded<'_, '_> {
    fn seek(&mut self, position: SeekFrom) -> io::Result<u64> {
        let result = self.file.seek(position);
        self.keep(result)
    }
}

/// Lets `fill` write a temporary file in the folder of `path`, which takes that name once it is
/// complete. After an error there is no temporary file, and `path` is what it was.
pub(crate) fn replace(
    path: &Path,
    progress: &mut Progress<'_>,
    fill: impl FnOnce(&mut Guarded<'_, '_>) -> Result<(), BakeError>,
) -> Result<(), BakeError> {
    let io = |source| BakeError::Io { action: "write", path: path.to_owned(), source };
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if path.is_dir() {
        return Err(io(io::Error::new(io::ErrorKind::IsADirectory, "it is a folder")));
    }
    let mut builder = tempfile::Builder::new();
    builder.prefix(".bake-").suffix(".part");
    // A temporary file is private by default; the result is to have the usual rights.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let file = builder.tempfile_in(folder).map_err(io)?;
    let (result, stopped, failure) = {
        let mut writer = Guarded {
            file: BufWriter::with_capacity(BUFFER, file.as_file()),
            progress,
            failure: None,
            stopped: false,
            since: 0,
            rows: Rc::default(),
        };
        let result = fill(&mut writer).and_then(|()| writer.flush().map_err(io));
        let Guarded { file: buffer, failure, stopped, progress: _, since: _, rows: _ } = writer;
        // What could not be written must not be tried again as the buffer goes.
        drop(buffer.into_parts());
        (result, stopped, failure)
    };
    if stopped {
        return Err(BakeError::Interrupted);
    }
    if let Some(source) = failure {
        return Err(io(source));
    }
    result?;
    file.persist(path).map_err(|error| io(error.error))?;
    Ok(())
}
