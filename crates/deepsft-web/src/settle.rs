//! Promises that settle in every case, also when Rust panics.
//!
//! A panic ends in a trap: the WebAssembly instance is left half-way through something, and the promise
//! that was being worked on would wait for ever. So every promise of this crate is registered here until
//! it settles; the panic hook rejects those that wait, and from then on every call is refused.

use crate::failure::{Code, Failure};
use js_sys::{Function, Promise};
use std::{
    cell::RefCell,
    collections::BTreeMap,
    panic::{self, PanicHookInfo},
    sync::Once,
};
use wasm_bindgen::JsValue;
use wasm_bindgen_futures::spawn_local;

thread_local! {
    static WAITING: RefCell<Waiting> = RefCell::default();
}

/// The promises under way, and what ended them all.
#[derive(Default)]
struct Waiting {
    rejects: BTreeMap<u32, Function>,
    last_ticket: u32,
    panic: Option<Failure>,
}

/// The promise of a future, run from the next microtask on.
pub fn promise<F, T>(future: F) -> Promise
where
    F: Future<Output = Result<T, Failure>> + 'static,
    T: Into<JsValue>,
{
    static HOOK: Once = Once::new();
    HOOK.call_once(|| panic::set_hook(Box::new(on_panic)));
    if let Some(failure) = WAITING.with_borrow(|waiting| waiting.panic.clone()) {
        return Promise::reject(&failure.into());
    }
    let mut future = Some(future);
    Promise::new(&mut |resolve, reject| {
        let Some(future) = future.take() else { return };
        let ticket = WAITING.with_borrow_mut(|waiting| {
            waiting.last_ticket = waiting.last_ticket.wrapping_add(1);
            waiting.rejects.insert(waiting.last_ticket, reject);
            waiting.last_ticket
        });
        spawn_local(async move {
            let outcome = future.await;
            let reject = WAITING.with_borrow_mut(|waiting| waiting.rejects.remove(&ticket));
            match (outcome, reject) {
                (Ok(value), _) => settle(&resolve, &value.into()),
                (Err(failure), Some(reject)) => settle(&reject, &failure.into()),
                (Err(_), None) => {}
            }
        });
    })
}

/// Calls `resolve` or `reject`, which never throw.
fn settle(function: &Function, value: &JsValue) {
    let _ = function.call1(&JsValue::UNDEFINED, value);
}

fn on_panic(info: &PanicHookInfo<'_>) {
    // The stack goes to the console, for a bug report.
    console_error_panic_hook::hook(info);
    let place = info
        .location()
        .map(|place| format!(" at {}:{}", place.file(), place.line()))
        .unwrap_or_default();
    let reason = info.payload_as_str().unwrap_or("unknown reason");
    let failure = Failure::new(
        Code::Internal,
        format!("The engine stopped because of a defect ({reason}{place})."),
    );
    // A panic within one of the short borrows above finds the cell taken: then nobody can be told.
    let waiting = WAITING.with(|waiting| {
        let mut waiting = waiting.try_borrow_mut().ok()?;
        waiting.panic.get_or_insert_with(|| failure.clone());
        Some(std::mem::take(&mut waiting.rejects))
    });
    for reject in waiting.unwrap_or_default().values() {
        settle(reject, &failure.clone().into());
    }
}
