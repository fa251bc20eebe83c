//! A JSON schema for people: one line for a type, a table for an object.

use std::fmt::Write as _;

use serde_json::Value;

use super::{escape, markdown};

/// The type in a few words, as HTML.
pub(super) fn kind(schema: &Value) -> String {
    if let Some(reference) = schema["$ref"].as_str() {
        let name = reference.rsplit('/').next().unwrap_or_default();
        return format!("<a href=\"#schema-{0}\">{0}</a>", escape(name));
    }
    for (key, word) in [("oneOf", " or "), ("anyOf", " or "), ("allOf", " and ")] {
        if let Some(choices) = schema[key].as_array() {
            let choices: Vec<String> = choices.iter().map(kind).collect();
            return choices.join(word);
        }
    }
    if let Some(only) = schema.get("const") {
        return format!("<code>{}</code>", escape(&only.to_string()));
    }
    if let Some(values) = schema["enum"].as_array() {
        let values = values
            .iter()
            .map(|value| format!("<code>{}</code>", escape(&value.to_string())));
        return values.collect::<Vec<_>>().join(", ");
    }
    let types = match &schema["type"] {
        Value::Array(types) => types.iter().filter_map(Value::as_str).collect(),
        Value::String(only) => vec![only.as_str()],
        _ => return "anything".to_owned(),
    };
    let types: Vec<String> = types.iter().map(|name| of_type(name, schema)).collect();
    types.join(" or ")
}

fn of_type(name: &str, schema: &Value) -> String {
    let mut text = match schema.get("items").filter(|_| name == "array") {
        Some(items) => format!("array of {}", kind(items)),
        None => name.to_owned(),
    };
    if name == "null" {
        return text;
    }
    for (key, word) in [
        ("format", ", "),
        ("minimum", ", &ge; "),
        ("exclusiveMinimum", ", &gt; "),
        ("maximum", ", &le; "),
        ("exclusiveMaximum", ", &lt; "),
        ("minItems", ", at least "),
        ("maxItems", ", at most "),
        ("maxLength", ", characters at most "),
    ] {
        if let Some(value) = schema.get(key) {
            let value = value
                .as_str()
                .map_or_else(|| value.to_string(), str::to_owned);
            text.push_str(word);
            text.push_str(&escape(&value));
        }
    }
    text
}

/// Its description and its default.
pub(super) fn meaning(schema: &Value) -> String {
    let mut text = String::new();
    if let Some(description) = schema["description"].as_str() {
        text.push_str(&markdown::html(description));
    }
    if let Some(default) = schema.get("default") {
        let default = escape(&default.to_string());
        text += "<p class=\"faint\">Default <code>";
        text += &default;
        text += "</code></p>";
    }
    text
}

/// A section for the schema called `name`.
pub(super) fn section(name: &str, schema: &Value) -> String {
    let name = escape(name);
    let fields = properties(schema).unwrap_or_else(|| format!("<p>{}</p>\n", kind(schema)));
    let whole = serde_json::to_string_pretty(schema).expect("it was read from text");
    let whole = escape(&whole);
    format!(
        "<h3 id=\"schema-{name}\"><a href=\"#schema-{name}\">{name}</a></h3>\n{}{fields}\
         <details><summary>JSON schema</summary><pre>{whole}</pre></details>\n",
        meaning(schema)
    )
}

/// A table of an object's fields, including those of nested objects.
fn properties(schema: &Value) -> Option<String> {
    schema["properties"].as_object()?;
    let mut rows = String::new();
    add_rows("", schema, &mut rows);
    Some(format!(
        "<div class=\"scroll\"><table><thead><tr><th>Field<th>Type<th>Meaning</thead><tbody>\n{rows}</tbody></table></div>\n"
    ))
}

fn add_rows(prefix: &str, schema: &Value, rows: &mut String) {
    let required = |name: &str| {
        let names = schema["required"].as_array();
        names.is_some_and(|names| names.iter().any(|known| known == name))
    };
    for (name, field) in schema["properties"].as_object().into_iter().flatten() {
        let path = format!("{prefix}{name}");
        let must = if required(name) {
            " <span class=\"faint\">required</span>"
        } else {
            ""
        };
        writeln!(
            rows,
            "<tr><td><code>{}</code>{must}<td>{}<td>{}",
            escape(&path),
            kind(field),
            meaning(field)
        )
        .expect("writing to a string cannot fail");
        add_rows(&format!("{path}."), field, rows);
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn types_are_described_briefly() {
        for (schema, expected) in [
            (json!({"type": "string", "format": "uuid"}), "string, uuid"),
            (
                json!({"type": ["integer", "null"], "minimum": 1}),
                "integer, &ge; 1 or null",
            ),
            (
                json!({"type": "array", "items": {"$ref": "#/components/schemas/Path"}, "maxItems": 3}),
                "array of <a href=\"#schema-Path\">Path</a>, at most 3",
            ),
            (
                json!({"enum": ["a", "<b>"]}),
                "<code>&quot;a&quot;</code>, <code>&quot;&lt;b&gt;&quot;</code>",
            ),
            (
                json!({"oneOf": [{"type": "number"}, {"const": 0}]}),
                "number or <code>0</code>",
            ),
            (json!({}), "anything"),
        ] {
            assert_eq!(kind(&schema), expected);
        }
    }
}
