//! Limits for slow clients (docs/explanation/promises.md, "Slow clients").
//!
//! Every client occupies one of a limited number of connections. It must therefore read a part of the
//! response from time to time, and send a body at a minimum average rate. Time during which the client waits
//! for the server does not count.
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
/// Total waiting time that every body may cause, in addition to what its length allows. Free choice.
const GRACE: Duration = Duration::from_secs(30);
/// Minimum average rate of a body, bytes per second. Any line that is used to send videos is faster.
const MIN_BYTES_PER_S: f64 = 1024.0;

/// Longest time that a connection lingers, and longest pause of its client. Those of nginx.
const MAX_LINGER: Duration = Duration::from_secs(30);
const MAX_LINGER_PAUSE: Duration = Duration::from_secs(5);

/// Whether the last body of a connection was dropped before its end.
#[derive(Clone, Debug, Default)]
pub(super) struct Unread(Arc<AtomicBool>);

/// A connection whose writes fail if the client reads nothing for too long, and which may linger.
pub(super) struct WriteTimeout<S> {
    stream: S,
    unread: Unread,
    /// End of lingering, and end of the client's pause.
    lingering: Option<(Instant, Pin<Box<Sleep>>)>,
    max_wait: Duration,
    waiting: Option<Pin<Box<Sleep>>>,
}

impl<S> WriteTimeout<S> {
    pub(super) fn new(stream: S, unread: Unread) -> WriteTimeout<S> {
        WriteTimeout {
            stream,
            unread,
            lingering: None,
            max_wait: MAX_WRITE_WAIT,
            waiting: None,
        }
    }

    /// Passes on the result of a write. Fails with `TimedOut` if the write has been pending for too long.
    fn limit_wait(
        &mut self,
        context: &mut Context<'_>,
        written: Poll<io::Result<usize>>,
    ) -> Poll<io::Result<usize>> {
        if written.is_ready() {
            self.waiting = None;
            return written;
        }
        let max_wait = self.max_wait;
        let waiting = self
            .waiting
            .get_or_insert_with(|| Box::pin(sleep(max_wait)));
        ready!(waiting.as_mut().poll(context));
        Poll::Ready(Err(io::ErrorKind::TimedOut.into()))
    }
}

impl<S: AsyncRead + Unpin> WriteTimeout<S> {
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

impl<S: AsyncRead + AsyncWrite + Unpin> AsyncWrite for WriteTimeout<S> {
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

impl<S: AsyncRead + Unpin> AsyncRead for WriteTimeout<S> {
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
    grace: Duration,
    /// Total time spent waiting for the chunks received so far.
    waited: Duration,
    /// Start of the current wait, and the timer that limits it.
    waiting: Option<(Instant, Pin<Box<Sleep>>)>,
    n_bytes: f64,
}

impl<B: Body> MinRateBody<B> {
    /// Returns the body of the next request of a connection.
    pub(super) fn new(body: B, unread: Unread) -> MinRateBody<B> {
        unread.0.store(false, Ordering::Relaxed);
        MinRateBody {
            body,
            unread,
            is_at_end: false,
            grace: GRACE,
            waited: Duration::ZERO,
            waiting: None,
            n_bytes: 0.0,
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
            if let Some((since, _)) = this.waiting.take() {
                this.waited += since.elapsed();
            }
            let data = frame
                .as_ref()
                .and_then(|frame| frame.as_ref().ok()?.data_ref());
            this.n_bytes += data.map_or(0, Buf::remaining) as f64;
            this.is_at_end = frame.is_none();
            return Poll::Ready(frame.map(|frame| frame.map_err(Into::into)));
        }
        let allowed = this.grace + Duration::from_secs_f64(this.n_bytes / MIN_BYTES_PER_S);
        let left = allowed.saturating_sub(this.waited);
        let begin = || (Instant::now(), Box::pin(sleep(left)));
        let (_since, end) = this.waiting.get_or_insert_with(begin);
        ready!(end.as_mut().poll(context));
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
        let mut ours = WriteTimeout::new(ours, Unread::default());
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

    /// Returns a body of 100 chunks of `n_bytes` bytes, one every tenth of [`SOON`].
    fn dripping(n_bytes: usize) -> MinRateBody<AnyBody> {
        let pieces = unfold(0, move |k| async move {
            tokio::time::sleep(SOON / 10).await;
            (k < 100).then(|| (Ok::<_, io::Error>(Bytes::from(vec![7; n_bytes])), k + 1))
        });
        let mut body = MinRateBody::new(AnyBody::from_stream(pieces), Unread::default());
        body.grace = SOON;
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
        body.grace = SOON / 10;
        let mut pieces = AnyBody::new(body).into_data_stream();
        while let Some(piece) = pieces.next().await {
            piece.unwrap();
            tokio::time::sleep(SOON / 2).await;
        }
    }
}
