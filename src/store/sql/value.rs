//! The parameters of a statement, for either engine. Only the column types of our tables exist. A null has a
//! type too, because PostgreSQL requires it.

use sqlx::types::Uuid;
use sqlx::{Arguments, Database, Encode, Type};

use crate::store::owners::Owner;

/// One parameter.
#[derive(Clone, Debug)]
pub(in crate::store) enum Value {
    Integer(Option<i64>),
    Real(Option<f64>),
    Boolean(bool),
    Text(Option<String>),
    Bytes(Option<Vec<u8>>),
    Uuid(Option<Uuid>),
}

/// Returns the parameters in the form of an engine.
pub(super) fn arguments<DB: Database>(values: Vec<Value>) -> Result<DB::Arguments, sqlx::Error>
where
    Option<i64>: for<'q> Encode<'q, DB> + Type<DB>,
    Option<f64>: for<'q> Encode<'q, DB> + Type<DB>,
    bool: for<'q> Encode<'q, DB> + Type<DB>,
    Option<String>: for<'q> Encode<'q, DB> + Type<DB>,
    Option<Vec<u8>>: for<'q> Encode<'q, DB> + Type<DB>,
    Option<Uuid>: for<'q> Encode<'q, DB> + Type<DB>,
{
    let mut arguments = DB::Arguments::default();
    for value in values {
        let added = match value {
            Value::Integer(value) => arguments.add(value),
            Value::Real(value) => arguments.add(value),
            Value::Boolean(value) => arguments.add(value),
            Value::Text(value) => arguments.add(value),
            Value::Bytes(value) => arguments.add(value),
            Value::Uuid(value) => arguments.add(value),
        };
        added.map_err(sqlx::Error::Encode)?;
    }
    Ok(arguments)
}

/// Implements `From` for types of parameters.
macro_rules! from {
    ($($type:ty => |$value:ident| $parameter:expr;)*) => {$(
        impl From<$type> for Value {
            fn from($value: $type) -> Value {
                $parameter
            }
        }
    )*};
}

from! {
    i64 => |value| Value::Integer(Some(value));
    Option<i64> => |value| Value::Integer(value);
    f64 => |value| Value::Real(Some(value));
    Option<f64> => |value| Value::Real(value);
    bool => |value| Value::Boolean(value);
    &str => |value| Value::Text(Some(value.to_owned()));
    Option<&str> => |value| Value::Text(value.map(str::to_owned));
    String => |value| Value::Text(Some(value));
    &String => |value| Value::Text(Some(value.clone()));
    &Owner => |value| Value::Text(Some(value.0.clone()));
    &[u8] => |value| Value::Bytes(Some(value.to_vec()));
    Option<&[u8]> => |value| Value::Bytes(value.map(<[u8]>::to_vec));
    &Vec<u8> => |value| Value::Bytes(Some(value.clone()));
    Uuid => |value| Value::Uuid(Some(value));
    Option<Uuid> => |value| Value::Uuid(value);
}
