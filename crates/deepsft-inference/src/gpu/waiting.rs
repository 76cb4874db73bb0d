//! A value that a callback sends to who waits for it.

use std::future::poll_fn;
use std::sync::{Arc, Mutex, PoisonError};
use std::task::{Poll, Waker};

/// The callback, and what waits for the value that it is given.
pub(super) fn channel<T>() -> (impl FnOnce(T), impl Future<Output = T>) {
    // What was sent, and who waits.
    let shared = Arc::new(Mutex::new((None, None::<Waker>)));
    let sent = shared.clone();
    let send = move |value| {
        let waker = {
            let mut shared = shared.lock().unwrap_or_else(PoisonError::into_inner);
            shared.0 = Some(value);
            shared.1.take()
        };
        if let Some(waker) = waker {
            waker.wake();
        }
    };
    let receive = poll_fn(move |context| {
        let mut sent = sent.lock().unwrap_or_else(PoisonError::into_inner);
        sent.1 = Some(context.waker().clone());
        sent.0.take().map_or(Poll::Pending, Poll::Ready)
    });
    (send, receive)
}
