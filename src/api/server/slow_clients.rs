//! Limits for slow clients (docs/explanation/promises.md, "Slow clients").
//!
//! Every client occupies one of a limited number of connections. It must therefore send and read at a minimum average
//! rate, and read a part of the response from time to time. Time during which the client waits for the server does not
//! count.
//!
//! A connection lingers if its last request was answered before its body was read: the rest of the body is
//! received and dropped for a while. Otherwise a client that is still sending would see a broken connection
//! instead of the response.

use std::io;
use std::pin::Pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::{Context, Poll, ready};
use std::time::Duration;

use hyper::body::{Body, Buf, Frame, SizeHint};
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::time::{Instant, Sleep, sleep};

/// Longest time during which a client may read nothing of a response. Free choice.
const MAX_WRITE_WAIT: Duration = Duration::from_secs(60);
/// Total waiting time that every body, and every connection that is read, may cause in addition to what its length
/// allows. Free choice.
const GRACE: Duration = Duration::from_secs(30);
/// Minimum average rate of a body and of reading, bytes per second. Any line that is used to send videos is faster.
const MIN_BYTES_PER_S: f64 = 1024.0;

/// Longest time that a connection lingers, and longest pause of its client. Those of nginx.
const MAX_LINGER: Duration = Duration::from_secs(30);
const MAX_LINGER_PAUSE: Duration = Duration::from_secs(5);

/// Whether the last body of a connection was dropped before its end.
#[derive(Clone, Debug, Default)]
pub(super) struct Unread(Arc<AtomicBool>);

/// A connection whose writes fail if the client reads nothing for too long, or too slowly, and which may linger.
pub(super) struct MinRateStream<S> {
    stream: S,
    unread: Unread,
    /// End of lingering, and end of the client's pause.
    lingering: Option<(Instant, Pin<Box<Sleep>>)>,
    max_wait: Duration,
    allowed: Allowed,
}

/// The waiting time that a client may cause: it grows with the bytes of the client.
struct Allowed {
    grace: Duration,
    n_bytes: f64,
    /// Time spent waiting so far.
    waited: Duration,
    /// Start of the current wait, and the timer that limits it.
    waiting: Option<(Instant, Pin<Box<Sleep>>)>,
}

impl Allowed {
    fn new(grace: Duration) -> Allowed {
        Allowed {
            grace,
            n_bytes: 0.0,
            waited: Duration::ZERO,
            waiting: None,
        }
    }

    /// Ends a wait, after which the client has sent or read `n_bytes` more.
    fn end_wait(&mut self, n_bytes: usize) {
        if let Some((since, _)) = self.waiting.take() {
            self.waited += since.elapsed();
        }
        self.n_bytes += n_bytes as f64;
    }

    /// Is ready once the client has caused too much waiting, or this wait is longer than `longest`.
    fn poll_end(&mut self, context: &mut Context<'_>, longest: Duration) -> Poll<()> {
        let allowed = self.grace + Duration::from_secs_f64(self.n_bytes / MIN_BYTES_PER_S);
        let left = allowed.saturating_sub(self.waited).min(longest);
        let begin = || (Instant::now(), Box::pin(sleep(left)));
        let (_since, end) = self.waiting.get_or_insert_with(begin);
        end.as_mut().poll(context)
    }
}

impl<S> MinRateStream<S> {
    pub(super) fn new(stream: S, unread: Unread) -> MinRateStream<S> {
        MinRateStream {
            stream,
            unread,
            lingering: None,
            max_wait: MAX_WRITE_WAIT,
            allowed: Allowed::new(GRACE),
        }
    }

    /// Passes on the result of a write. Fails with `TimedOut` if the client reads too slowly.
    fn limit_wait(
        &mut self,
        context: &mut Context<'_>,
        written: Poll<io::Result<usize>>,
    ) -> Poll<io::Result<usize>> {
        if let Poll::Ready(written) = written {
            self.allowed.end_wait(*written.as_ref().unwrap_or(&0));
            return Poll::Ready(written);
        }
        ready!(self.allowed.poll_end(context, self.max_wait));
        Poll::Ready(Err(io::ErrorKind::TimedOut.into()))
    }
}

impl<S: AsyncRead + Unpin> MinRateStream<S> {
    /// Receives and drops what the client still sends, until it closes the connection or takes too long.
    fn poll_linger(&mut self, context: &mut Context<'_>) -> Poll<()> {
        let mut bytes = [0; 16 << 10];
        let (end, pause) = self.lingering.get_or_insert_with(|| {
            let end = Instant::now() + MAX_LINGER;
            (end, Box::pin(sleep(MAX_LINGER_PAUSE)))
        });
        while Instant::now() < *end {
            let mut buffer = ReadBuf::new(&mut bytes);
            match Pin::new(&mut self.stream).poll_read(context, &mut buffer) {
                Poll::Ready(Ok(())) if !buffer.filled().is_empty() => {
                    let until = Instant::now() + MAX_LINGER_PAUSE;
                    pause.as_mut().reset(until.min(*end));
                }
                Poll::Ready(_) => return Poll::Ready(()),
                Poll::Pending => return pause.as_mut().poll(context),
            }
        }
        Poll::Ready(())
    }
}

impl<S: AsyncRead + AsyncWrite + Unpin> AsyncWrite for MinRateStream<S> {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        let written = Pin::new(&mut self.stream).poll_write(context, bytes);
        self.limit_wait(context, written)
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        pieces: &[io::IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        let written = Pin::new(&mut self.stream).poll_write_vectored(context, pieces);
        self.limit_wait(context, written)
    }

    fn is_write_vectored(&self) -> bool {
        self.stream.is_write_vectored()
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        if self.lingering.is_none() {
            ready!(Pin::new(&mut self.stream).poll_shutdown(context))?;
        }
        if self.unread.0.load(Ordering::Relaxed) {
            ready!(self.poll_linger(context));
        }
        Poll::Ready(Ok(()))
    }
}

impl<S: AsyncRead + Unpin> AsyncRead for MinRateStream<S> {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_read(context, buffer)
    }
}

/// The client sent the body too slowly.
#[derive(Debug, thiserror::Error)]
#[error("the body came too slowly")]
pub(in crate::api) struct TooSlow;

/// Returns whether the error of a body was caused by [`TooSlow`].
pub(in crate::api) fn is_too_slow(error: &dyn std::error::Error) -> bool {
    let mut cause = error.source();
    while let Some(error) = cause {
        if error.is::<TooSlow>() {
            return true;
        }
        cause = error.source();
    }
    false
}

/// A body that fails with [`TooSlow`] if the total waiting time is too long for the number of bytes received.
pub(super) struct MinRateBody<B: Body> {
    body: B,
    unread: Unread,
    is_at_end: bool,
    allowed: Allowed,
}

impl<B: Body> MinRateBody<B> {
    /// Returns the body of the next request of a connection.
    pub(super) fn new(body: B, unread: Unread) -> MinRateBody<B> {
        unread.0.store(false, Ordering::Relaxed);
        MinRateBody {
            body,
            unread,
            is_at_end: false,
            allowed: Allowed::new(GRACE),
        }
    }
}

impl<B> Body for MinRateBody<B>
where
    B: Body + Unpin,
    B::Error: Into<axum::BoxError>,
{
    type Data = B::Data;
    type Error = axum::BoxError;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<B::Data>, axum::BoxError>>> {
        let this = &mut *self;
        if let Poll::Ready(frame) = Pin::new(&mut this.body).poll_frame(context) {
            let data = frame
                .as_ref()
                .and_then(|frame| frame.as_ref().ok()?.data_ref());
            this.allowed.end_wait(data.map_or(0, Buf::remaining));
            this.is_at_end = frame.is_none();
            return Poll::Ready(frame.map(|frame| frame.map_err(Into::into)));
        }
        ready!(this.allowed.poll_end(context, Duration::MAX));
        Poll::Ready(Some(Err(TooSlow.into())))
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}

impl<B: Body> Drop for MinRateBody<B> {
    fn drop(&mut self) {
        let is_unread = !self.is_at_end && !self.body.is_end_stream();
        self.unread.0.store(is_unread, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use axum::body::Body as AnyBody;
    use bytes::Bytes;
    use futures_util::stream::{StreamExt, unfold};
    use tokio::io::{AsyncReadExt, AsyncWriteExt, duplex};

    use super::*;

    const SOON: Duration = Duration::from_millis(100);

    #[tokio::test]
    async fn write_times_out_only_if_the_client_reads_nothing() {
        let (ours, mut theirs) = duplex(16);
        let mut ours = MinRateStream::new(ours, Unread::default());
        ours.max_wait = SOON;
        let read = async {
            for _ in 0..8 {
                tokio::time::sleep(SOON / 2).await;
                theirs.read_exact(&mut [0; 16]).await.unwrap();
            }
            theirs
        };
        let (written, _open) = tokio::join!(ours.write_all(&[7; 8 * 16]), read);
        written.unwrap();
        let refused = ours.write_all(&[7; 32]).await.unwrap_err();
        assert_eq!(refused.kind(), io::ErrorKind::TimedOut);
    }

    #[tokio::test]
    async fn write_to_a_client_that_reads_below_the_minimum_rate_is_cut_off() {
        let (ours, mut theirs) = duplex(16);
        let mut ours = MinRateStream::new(ours, Unread::default());
        ours.allowed.grace = SOON;
        let read = async {
            while theirs.read_exact(&mut [0; 1]).await.is_ok() {
                tokio::time::sleep(SOON / 4).await;
            }
        };
        let written = tokio::select! {
            written = ours.write_all(&[7; 1000]) => written,
            () = read => unreachable!("the stream is open"),
        };
        assert_eq!(written.unwrap_err().kind(), io::ErrorKind::TimedOut);
    }

    /// Returns a body of 100 chunks of `n_bytes` bytes, one every tenth of [`SOON`].
    fn dripping(n_bytes: usize) -> MinRateBody<AnyBody> {
        let pieces = unfold(0, move |k| async move {
            tokio::time::sleep(SOON / 10).await;
            (k < 100).then(|| (Ok::<_, io::Error>(Bytes::from(vec![7; n_bytes])), k + 1))
        });
        let mut body = MinRateBody::new(AnyBody::from_stream(pieces), Unread::default());
        body.allowed.grace = SOON;
        body
    }

    #[tokio::test]
    async fn body_below_the_minimum_rate_is_cut_off() {
        let mut drips = AnyBody::new(dripping(1)).into_data_stream();
        let error = loop {
            if let Err(error) = drips.next().await.unwrap() {
                break error;
            }
        };
        assert!(is_too_slow(&error), "{error:?}");
        let mut flows = AnyBody::new(dripping(100)).into_data_stream();
        while let Some(piece) = flows.next().await {
            piece.unwrap();
        }
    }

    #[tokio::test]
    async fn time_between_reads_of_the_server_does_not_count() {
        let body = AnyBody::from_stream(futures_util::stream::iter(
            [b"x"; 3].map(|piece| Ok::<_, io::Error>(Bytes::from_static(piece))),
        ));
        let mut body = MinRateBody::new(body, Unread::default());
        body.allowed.grace = SOON / 10;
        let mut pieces = AnyBody::new(body).into_data_stream();
        while let Some(piece) = pieces.next().await {
            piece.unwrap();
            tokio::time::sleep(SOON / 2).await;
        }
    }
}
