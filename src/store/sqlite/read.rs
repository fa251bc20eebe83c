//! Reads from the store, over a few read-only connections beside the writer's.

use std::error::Error;
use std::sync::Arc;

use parking_lot::Mutex;
use rusqlite::Error::QueryReturnedNoRows;
use rusqlite::types::{Value, ValueRef};
use rusqlite::{Connection, OpenFlags, OptionalExtension, params_from_iter};
use tokio::sync::Semaphore;

use super::BUSY_TIMEOUT;
use super::opening::Place;
use super::packed;
use super::row::{COLUMNS, PlanRow};
use super::unreadable::{Passed, Unreadable, is_the_row_s};
use crate::export::document::Incumbent;
use crate::job::{Event, NumberedEvent, Plan, PlanId, Status};
use crate::store::{
    DatasetUse, EventPage, LastEvent, ListQuery, RUNS_IN_MEAN, Stats, StoreError, TOMBSTONE_MS,
    Tombstone,
};

/// Concurrent reads; further ones wait.
const CONNECTIONS: u32 = 8;

/// The pool of read-only connections.
pub(super) struct Readers {
    place: Arc<Place>,
    idle: Mutex<Vec<Connection>>,
    permits: Arc<Semaphore>,
}

impl Readers {
    pub(super) fn new(place: Arc<Place>) -> Arc<Self> {
        Arc::new(Self {
            place,
            idle: Mutex::default(),
            permits: Arc::new(Semaphore::new(CONNECTIONS as usize)),
        })
    }

    /// Run `work` in one read transaction on a thread that may block.
    pub(super) async fn read<T, W>(self: &Arc<Self>, work: W) -> Result<T, StoreError>
    where
        T: Send + 'static,
        W: FnOnce(&Connection) -> Result<T, StoreError> + Send + 'static,
    {
        let permit = self
            .permits
            .clone()
            .acquire_owned()
            .await
            .map_err(|_| StoreError::closed())?;
        let readers = Arc::clone(self);
        let task = tokio::task::spawn_blocking(move || {
            let mut connection = readers.take()?;
            let transaction = connection.transaction()?;
            let result = work(&transaction);
            drop(transaction);
            readers.idle.lock().push(connection);
            drop(permit);
            result
        });
        task.await
            .map_err(|broken| StoreError::unavailable(format!("a read broke: {broken}")))?
    }

    /// Wait for the reads under way; later ones fail.
    pub(super) async fn close(&self) {
        let _every_permit = self.permits.acquire_many(CONNECTIONS).await;
        self.permits.close();
        self.idle.lock().clear();
    }

    fn take(&self) -> Result<Connection, StoreError> {
        let idle = self.idle.lock().pop();
        idle.map_or_else(|| self.open(), Ok)
    }

    fn open(&self) -> Result<Connection, StoreError> {
        let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
        let connection = Connection::open_with_flags(self.place.path(), flags)?;
        // What is there may be another file by now.
        self.place.check()?;
        connection.busy_timeout(BUSY_TIMEOUT)?;
        connection.set_prepared_statement_cache_capacity(32);
        Ok(connection)
    }
}

pub(super) fn get(connection: &Connection, id: PlanId, expiry_ms: i64) -> Result<Plan, StoreError> {
    match PlanRow::load(connection, id)? {
        Some(row) => Ok(row.plan),
        None => Err(missing(connection, id, expiry_ms)?),
    }
}

pub(super) fn scenario(
    connection: &Connection,
    id: PlanId,
    expiry_ms: i64,
) -> Result<String, StoreError> {
    let sql = "SELECT document FROM plans LEFT JOIN scenarios ON plan_seq = seq WHERE id = ?1";
    match found(connection, sql, id) {
        Ok(Some(document)) => Ok(document),
        Ok(None) => Err(StoreError::ScenarioLost(id)),
        Err(QueryReturnedNoRows) => Err(missing(connection, id, expiry_ms)?),
        // What is no text is not what was written.
        Err(error) if is_the_row_s(&error) => Err(StoreError::ScenarioLost(id)),
        Err(error) => Err(error.into()),
    }
}

pub(super) fn result(
    connection: &Connection,
    id: PlanId,
    expiry_ms: i64,
) -> Result<Option<String>, StoreError> {
    let sql = "SELECT document FROM plans LEFT JOIN results ON plan_seq = seq WHERE id = ?1";
    document(connection, sql, id, expiry_ms)
}

/// See [`Store::incumbent`](crate::store::Store::incumbent).
pub(super) fn incumbent(
    connection: &Connection,
    id: PlanId,
    expiry_ms: i64,
) -> Result<Option<Incumbent>, StoreError> {
    let sql = "SELECT document FROM plans LEFT JOIN incumbents ON plan_seq = seq WHERE id = ?1";
    let document = document(connection, sql, id, expiry_ms)?;
    let read = document.map(|document| serde_json::from_str(&document));
    read.transpose()
        .map_err(|error| StoreError::unavailable(format!("best route of plan {id}: {error}")))
}

fn document(
    connection: &Connection,
    sql: &str,
    id: PlanId,
    expiry_ms: i64,
) -> Result<Option<String>, StoreError> {
    match found(connection, sql, id) {
        Ok(document) => Ok(document),
        Err(QueryReturnedNoRows) => Err(missing(connection, id, expiry_ms)?),
        Err(error) => Err(error.into()),
    }
}

/// A document of a plan, or [`QueryReturnedNoRows`] when there is no such plan.
fn found(connection: &Connection, sql: &str, id: PlanId) -> rusqlite::Result<Option<String>> {
    connection
        .prepare_cached(sql)?
        .query_row([id.to_string()], |row| row.get(0))
}

/// Plans whose record cannot be read are left out, and others take their place on the page.
pub(super) fn list(
    connection: &Connection,
    query: &ListQuery,
    passed: &Passed,
) -> Result<Vec<Plan>, StoreError> {
    let mut n_left_out = 0;
    let rows = loop {
        let (rows, left_out) = page(connection, query, query.limit.saturating_add(n_left_out))?;
        for row in &left_out {
            passed.over(row);
        }
        if left_out.len() == n_left_out {
            break rows;
        }
        n_left_out = left_out.len();
    };
    placed(connection, rows)
}

/// The first rows of a list: those that can be read, and the others.
fn page(
    connection: &Connection,
    query: &ListQuery,
    limit: usize,
) -> Result<(Vec<PlanRow>, Vec<Unreadable>), StoreError> {
    let mut conditions = Vec::new();
    let mut values = Vec::new();
    if let Some(status) = query.status {
        conditions.push("status = ?");
        values.push(Value::from(status.name().to_owned()));
    }
    if let Some(owner) = &query.owner {
        conditions.push("owner = ?");
        values.push(Value::from(owner.clone()));
    }
    if let Some(before) = query.before {
        conditions.push("id < ?");
        values.push(Value::from(before.to_string()));
    }
    values.push(Value::from(i64::try_from(limit).unwrap_or(i64::MAX)));
    let filter = if conditions.is_empty() {
        String::new()
    } else {
        format!("WHERE {}", conditions.join(" AND "))
    };
    let mut statement = connection.prepare_cached(&format!(
        "SELECT {COLUMNS} FROM plans {filter} ORDER BY id DESC LIMIT ?"
    ))?;
    let (mut rows, mut left_out) = (Vec::new(), Vec::new());
    for row in statement.query_map(params_from_iter(values), PlanRow::try_read)? {
        match row? {
            Ok(row) => rows.push(row),
            Err(unreadable) => left_out.push(unreadable),
        }
    }
    Ok((rows, left_out))
}

/// The records with their places in the queue.
fn placed(connection: &Connection, rows: Vec<PlanRow>) -> Result<Vec<Plan>, StoreError> {
    let some_queued = rows.iter().any(|row| row.plan.status == Status::Queued);
    let queue = if some_queued {
        queue(connection)?
    } else {
        Vec::new()
    };
    let placed = rows.into_iter().map(|mut row| {
        let place = queue.binary_search(&row.seq).ok();
        row.plan.queue_position = place.map(|place| place as u64 + 1);
        row.plan
    });
    Ok(placed.collect())
}

/// The `seq` of each queued plan, in order.
fn queue(connection: &Connection) -> rusqlite::Result<Vec<i64>> {
    connection
        .prepare_cached(
            "SELECT seq FROM plans INDEXED BY plans_queue WHERE status = 'queued' ORDER BY seq",
        )?
        .query_map([], |row| row.get(0))?
        .collect()
}

/// The events in a row.
fn batch(text: ValueRef<'_>, packed: ValueRef<'_>) -> Result<Vec<Event>, Box<dyn Error>> {
    Ok(match packed.as_blob_or_null()? {
        Some(bytes) => packed::unpack(bytes)?,
        None => serde_json::from_str(text.as_str()?)?,
    })
}

pub(super) fn events(
    connection: &Connection,
    id: PlanId,
    after: u64,
    limit: usize,
    expiry_ms: i64,
) -> Result<EventPage, StoreError> {
    let plan: Option<(i64, i64, Option<i64>)> = connection
        .prepare_cached("SELECT seq, forgotten, place FROM plans WHERE id = ?1")?
        .query_row([id.to_string()], |row| {
            Ok((row.get(0)?, row.get(1)?, row.get(2)?))
        })
        .optional()?;
    let Some((seq, forgotten, place)) = plan else {
        return Err(missing(connection, id, expiry_ms)?);
    };
    let after = i64::try_from(after).unwrap_or(i64::MAX);
    let mut statement = connection.prepare_cached(
        "SELECT first_id, batch, packed FROM events WHERE plan_seq = ?1 AND last_id > ?2 ORDER BY last_id",
    )?;
    let mut rows = statement.query([seq, after])?;
    let mut events = Vec::new();
    if let (0, 0, Some(place)) = (after, forgotten, place) {
        let accepted = get(connection, id, expiry_ms)?.as_accepted(place.cast_unsigned());
        events.push(NumberedEvent {
            id: 1,
            event: Event::Status(Box::new(accepted)),
        });
    }
    while events.len() < limit
        && let Some(row) = rows.next()?
    {
        let first_id: i64 = row.get(0)?;
        let batch = batch(row.get_ref(1)?, row.get_ref(2)?)
            .map_err(|error| StoreError::unavailable(format!("events of plan {id}: {error}")))?;
        let numbered = (first_id..).zip(batch).filter(|(id, _)| *id > after);
        events.extend(numbered.map(|(id, event)| NumberedEvent {
            id: id.cast_unsigned(),
            event,
        }));
    }
    events.truncate(limit);
    Ok(EventPage {
        forgotten: forgotten.cast_unsigned(),
        events,
    })
}

/// See [`Store::datasets_in_use`](crate::store::Store::datasets_in_use).
pub(super) fn datasets_in_use(connection: &Connection) -> Result<Vec<DatasetUse>, StoreError> {
    let mut statement = connection.prepare_cached(
        "SELECT dataset, sum(status IN ('queued', 'running')), count(*) \
         FROM plans INDEXED BY plans_by_dataset WHERE dataset IS NOT NULL \
         GROUP BY dataset ORDER BY dataset",
    )?;
    let uses = statement.query_map([], |row| {
        Ok(DatasetUse {
            sha256: row.get(0)?,
            active: row.get::<_, i64>(1)?.cast_unsigned(),
            plans: row.get::<_, i64>(2)?.cast_unsigned(),
        })
    })?;
    Ok(uses.collect::<Result<_, _>>()?)
}

pub(super) fn stats(connection: &Connection) -> Result<Stats, StoreError> {
    // With the name as a parameter, SQLite would plan the query anew each time, since an index may apply to one name
    // only.
    let count = |sql: &str| -> rusqlite::Result<u64> {
        connection
            .prepare_cached(sql)?
            .query_row([], |row| row.get::<_, i64>(0))
            .map(i64::cast_unsigned)
    };
    let mean_run_ms = connection
        .prepare_cached(
            "SELECT avg(finished_ms - started_ms) FROM (SELECT started_ms, finished_ms FROM plans \
             WHERE stop_reason IS NOT NULL ORDER BY finished_ms DESC LIMIT ?1)",
        )?
        .query_row([RUNS_IN_MEAN], |row| row.get(0))?;
    let oldest_queued_ms = connection
        .prepare_cached(
            "SELECT created_ms FROM plans INDEXED BY plans_queue WHERE status = 'queued' \
             ORDER BY seq LIMIT 1",
        )?
        .query_row([], |row| row.get(0))
        .optional()?;
    Ok(Stats {
        queued: count("SELECT count(*) FROM plans WHERE status = 'queued'")?,
        oldest_queued_ms,
        running: count("SELECT count(*) FROM plans WHERE status = 'running'")?,
        mean_run_ms,
        slots: None,
    })
}

/// The newest time that any record bears, milliseconds since 1970, or at which the store was last checked, unless that
/// is after `now_ms`; `None` in a new file.
pub(super) fn newest_ms(connection: &Connection, now_ms: i64) -> Result<Option<i64>, StoreError> {
    let newest_ms: i64 = connection.query_row(
        "SELECT max( \
            coalesce((SELECT max(checked_ms) FROM health WHERE checked_ms <= ?1), 0), \
            coalesce((SELECT created_ms FROM plans ORDER BY seq DESC LIMIT 1), 0), \
            coalesce((SELECT max(finished_ms) FROM plans WHERE finished_ms IS NOT NULL), 0), \
            coalesce((SELECT max(deleted_ms) FROM tombstones), 0))",
        [now_ms],
        |row| row.get(0),
    )?;
    Ok((newest_ms > 0).then_some(newest_ms))
}

/// Why there is no such plan.
pub(super) fn missing(
    connection: &Connection,
    id: PlanId,
    expiry_ms: i64,
) -> Result<StoreError, StoreError> {
    let tombstone: Option<(i64, Tombstone)> = connection
        .prepare_cached(
            "SELECT deleted_ms, owner, expired, status, last_event FROM tombstones WHERE id = ?1",
        )?
        .query_row([id.to_string()], |row| {
            let status: Option<String> = row.get(3)?;
            let status = status.as_deref().and_then(Status::from_name);
            let last: Option<i64> = row.get(4)?;
            let tombstone = Tombstone {
                id,
                owner: row.get(1)?,
                expired: row.get(2)?,
                end: status.zip(last).map(|(status, last)| LastEvent {
                    id: last.cast_unsigned(),
                    status,
                }),
            };
            Ok((row.get(0)?, tombstone))
        })
        .optional()?;
    Ok(match tombstone {
        Some((deleted_ms, tombstone)) if expiry_ms.saturating_sub(deleted_ms) < TOMBSTONE_MS => {
            StoreError::Gone(tombstone)
        }
        _ => StoreError::NotFound(id),
    })
}
