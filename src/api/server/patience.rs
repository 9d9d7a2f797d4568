//! How long we wait for those who are slow (RELIABILITY.md, H1): a reader must take something now and then, and a
//! body must come at some rate on the whole, for whoever keeps a connection open keeps one of few. Time in
//! which they wait for us does not count against them.

use std::io;
use std::pin::Pin;
use std::task::{Context, Poll, ready};
use std::time::Duration;

use hyper::body::{Body, Buf, Frame, SizeHint};
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::time::{Instant, Sleep, sleep};

/// The longest wait until a reader takes more of an answer.
const READER: Duration = Duration::from_secs(60);
/// What every body may wait for all in all, besides what its length allows.
const GRACE: Duration = Duration::from_secs(30);
/// The least rate of a body beyond that, bytes a second: slower than any line that films are sent over.
const LEAST_RATE: f64 = 1024.0;

/// A connection whose writes end with an error once nobody takes them.
pub(super) struct Patient<S> {
    stream: S,
    longest: Duration,
    waiting: Option<Pin<Box<Sleep>>>,
}

impl<S> Patient<S> {
    pub(super) fn new(stream: S) -> Patient<S> {
        Patient {
            stream,
            longest: READER,
            waiting: None,
        }
    }

    fn watch(
        &mut self,
        context: &mut Context<'_>,
        written: Poll<io::Result<usize>>,
    ) -> Poll<io::Result<usize>> {
        if written.is_ready() {
            self.waiting = None;
            return written;
        }
        let longest = self.longest;
        let waiting = self.waiting.get_or_insert_with(|| Box::pin(sleep(longest)));
        ready!(waiting.as_mut().poll(context));
        Poll::Ready(Err(io::ErrorKind::TimedOut.into()))
    }
}

impl<S: AsyncWrite + Unpin> AsyncWrite for Patient<S> {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        let written = Pin::new(&mut self.stream).poll_write(context, bytes);
        self.watch(context, written)
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        pieces: &[io::IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        let written = Pin::new(&mut self.stream).poll_write_vectored(context, pieces);
        self.watch(context, written)
    }

    fn is_write_vectored(&self) -> bool {
        self.stream.is_write_vectored()
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(context)
    }
}

impl<S: AsyncRead + Unpin> AsyncRead for Patient<S> {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_read(context, buffer)
    }
}

/// The body came too slowly.
#[derive(Debug, thiserror::Error)]
#[error("the body came too slowly")]
pub(in crate::api) struct TooSlow;

/// Whether an error of a body comes of its slowness.
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

/// A body that ends with [`TooSlow`] when we have waited for it too long for what came of it.
pub(super) struct Paced<B> {
    body: B,
    grace: Duration,
    /// How long we have waited for pieces that came.
    waited: Duration,
    /// Since when we wait for the next, and when that is too long.
    waiting: Option<(Instant, Pin<Box<Sleep>>)>,
    n_bytes: f64,
}

impl<B> Paced<B> {
    pub(super) fn new(body: B) -> Paced<B> {
        Paced {
            body,
            grace: GRACE,
            waited: Duration::ZERO,
            waiting: None,
            n_bytes: 0.0,
        }
    }
}

impl<B> Body for Paced<B>
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
            return Poll::Ready(frame.map(|frame| frame.map_err(Into::into)));
        }
        let allowed = this.grace + Duration::from_secs_f64(this.n_bytes / LEAST_RATE);
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

#[cfg(test)]
mod tests {
    use axum::body::Body as AnyBody;
    use bytes::Bytes;
    use futures_util::stream::{StreamExt, unfold};
    use tokio::io::{AsyncReadExt, AsyncWriteExt, duplex};

    use super::*;

    const SOON: Duration = Duration::from_millis(100);

    #[tokio::test]
    async fn who_takes_nothing_of_an_answer_is_left_and_who_takes_some_is_not() {
        let (ours, mut theirs) = duplex(16);
        let mut ours = Patient::new(ours);
        ours.longest = SOON;
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

    /// A body of pieces of so many bytes, each after a tenth of [`SOON`], for ten times as long.
    fn dripping(n_bytes: usize) -> Paced<AnyBody> {
        let pieces = unfold(0, move |k| async move {
            tokio::time::sleep(SOON / 10).await;
            (k < 100).then(|| (Ok::<_, io::Error>(Bytes::from(vec![7; n_bytes])), k + 1))
        });
        let mut paced = Paced::new(AnyBody::from_stream(pieces));
        paced.grace = SOON;
        paced
    }

    #[tokio::test]
    async fn a_body_that_drips_is_cut_off_and_one_that_flows_is_not() {
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
    async fn while_we_look_at_what_came_nobody_is_too_slow() {
        let body = AnyBody::from_stream(futures_util::stream::iter(
            [b"x"; 3].map(|piece| Ok::<_, io::Error>(Bytes::from_static(piece))),
        ));
        let mut paced = Paced::new(body);
        paced.grace = SOON / 10;
        let mut pieces = AnyBody::new(paced).into_data_stream();
        while let Some(piece) = pieces.next().await {
            piece.unwrap();
            tokio::time::sleep(SOON / 2).await;
        }
    }
}
