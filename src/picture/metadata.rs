//! What is known of a picture's making, as attributes of its file.

use exr::prelude::{AttributeValue, Text};
use std::collections::BTreeMap;

/// A value that EXR files can hold.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    Text(String),
    Integer(i32),
    Number(f64),
}

/// Attributes by their names.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Metadata(BTreeMap<String, Value>);

impl Metadata {
    pub fn text(&mut self, name: &str, text: impl Into<String>) {
        self.0.insert(name.to_owned(), Value::Text(text.into()));
    }

    pub fn number(&mut self, name: &str, number: impl Into<f64>) {
        self.0.insert(name.to_owned(), Value::Number(number.into()));
    }

    /// As an integer where the file format has room for it, otherwise as a text.
    pub fn integer(&mut self, name: &str, integer: u64) {
        let value = match i32::try_from(integer) {
            Ok(integer) => Value::Integer(integer),
            Err(_) => Value::Text(integer.to_string()),
        };
        self.0.insert(name.to_owned(), value);
    }

    pub fn get(&self, name: &str) -> Option<&Value> {
        self.0.get(name)
    }

    pub fn get_text(&self, name: &str) -> Option<&str> {
        match self.get(name)? {
            Value::Text(text) => Some(text),
            _ => None,
        }
    }

    pub fn iter(&self) -> impl Iterator<Item = (&str, &Value)> {
        self.0.iter().map(|(name, value)| (name.as_str(), value))
    }

    /// The attributes as a file holds them. EXR's texts are bytes: what is not ASCII goes in as UTF-8.
    pub(super) fn attributes(&self) -> impl Iterator<Item = (Text, AttributeValue)> + '_ {
        self.0.iter().map(|(name, value)| {
            let value = match value {
                Value::Text(text) => AttributeValue::Text(bytes(text)),
                Value::Integer(integer) => AttributeValue::I32(*integer),
                Value::Number(number) => AttributeValue::F64(*number),
            };
            (bytes(name), value)
        })
    }

    /// Takes over an attribute of a file, if it is of a kind that metadata has.
    pub(super) fn insert_attribute(&mut self, name: &Text, value: &AttributeValue) {
        let value = match value {
            AttributeValue::Text(text) => Value::Text(read(text)),
            AttributeValue::I32(integer) => Value::Integer(*integer),
            AttributeValue::F64(number) => Value::Number(*number),
            AttributeValue::F32(number) => Value::Number((*number).into()),
            _ => return,
        };
        self.0.insert(read(name), value);
    }
}

fn bytes(text: &str) -> Text {
    Text::from_bytes_unchecked(text.bytes().collect())
}

fn read(text: &Text) -> String {
    String::from_utf8_lossy(text.as_slice()).into_owned()
}
