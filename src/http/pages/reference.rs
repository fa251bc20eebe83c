//! The API reference: every operation with its parameters and answers, and every schema.

use std::fmt::{self, Write as _};

use serde_json::Value;

use super::{escape, guides, markdown, schema};

/// Where a service listens by default; the page does not know how its reader reaches this one.
const LOCAL: &str = "http://localhost:8080";

/// The content between `<body>` and `</body>`.
pub(super) fn body(description: &Value) -> String {
    let page = Page { description };
    let mut text = String::new();
    page.write(&mut text)
        .expect("writing to a string cannot fail");
    text
}

struct Page<'a> {
    description: &'a Value,
}

/// One method of one path.
struct Operation<'a> {
    method: String,
    path: &'a str,
    /// Parameters of the path and its own.
    parameters: Vec<&'a Value>,
    about: &'a Value,
}

impl<'a> Page<'a> {
    fn write(&self, out: &mut String) -> fmt::Result {
        let info = &self.description["info"];
        let (title, version) = (text(&info["title"]), text(&info["version"]));
        writeln!(
            out,
            "<header><h1>{title} <span class=\"faint\">{version}</span></h1>"
        )?;
        writeln!(out, "<p>{}.</p>", text(&info["summary"]))?;
        out.push_str(&markdown::html(
            info["description"].as_str().unwrap_or_default(),
        ));
        writeln!(
            out,
            "<p>For programs: <a href=\"/openapi.json\">openapi.json</a>, <a href=\"/openapi.yaml\">openapi.yaml</a>.</p>"
        )?;
        writeln!(
            out,
            "<h2 id=\"guides\">Guides</h2>\n<ul>\n{}</ul></header>",
            guides::links()
        )?;
        let operations = self.operations();
        write_contents(&operations, out)?;
        out.push_str("<main>\n");
        for tag in list(&self.description["tags"]) {
            writeln!(out, "<h2>{}</h2>", text(&tag["description"]))?;
            for operation in operations.iter().filter(|operation| operation.has(tag)) {
                self.write_operation(operation, out)?;
            }
        }
        out.push_str("<h2 id=\"schemas\">Schemas</h2>\n");
        for (name, described) in fields(&self.description["components"]["schemas"]) {
            out.push_str(&schema::section(name, described));
        }
        out.push_str("</main>");
        Ok(())
    }

    fn operations(&self) -> Vec<Operation<'a>> {
        let mut operations = Vec::new();
        for (path, item) in fields(&self.description["paths"]) {
            for (method, about) in fields(item).filter(|(key, _)| *key != "parameters") {
                let parameters = list(&item["parameters"]).chain(list(&about["parameters"]));
                operations.push(Operation {
                    method: method.to_uppercase(),
                    path,
                    parameters: parameters
                        .map(|parameter| self.resolve(parameter))
                        .collect(),
                    about,
                });
            }
        }
        operations
    }

    fn write_operation(&self, operation: &Operation, out: &mut String) -> fmt::Result {
        let about = operation.about;
        let id = text(&about["operationId"]);
        let (method, path) = (&operation.method, escape(operation.path));
        writeln!(out, "<section id=\"{id}\">")?;
        writeln!(
            out,
            "<h3><a href=\"#{id}\"><span class=\"method\">{method}</span> <code>{path}</code></a></h3>"
        )?;
        writeln!(out, "<p>{}.</p>", text(&about["summary"]))?;
        if let Some(more) = about["description"].as_str() {
            out.push_str(&markdown::html(more));
        }
        write_parameters(&operation.parameters, out)?;
        if about.get("requestBody").is_some() {
            let body = self.resolve(&about["requestBody"]);
            out.push_str("<h4>Body</h4>\n");
            self.write_content(body, out)?;
        }
        out.push_str("<h4>Example</h4>\n");
        writeln!(out, "<pre>{}</pre>", escape(&self.curl(operation)))?;
        out.push_str("<h4>Answers</h4>\n<div class=\"scroll\"><table><thead><tr><th>Status<th>Meaning<th>Headers<th>Body</thead><tbody>\n");
        for (status, answer) in fields(&about["responses"]) {
            let answer = self.resolve(answer);
            let headers: Vec<String> = fields(&answer["headers"])
                .map(|(name, _)| format!("<code>{}</code>", escape(name)))
                .collect();
            writeln!(
                out,
                "<tr><td><code>{status}</code><td>{}<td>{}<td>",
                markdown::html(answer["description"].as_str().unwrap_or_default()),
                headers.join("<br>")
            )?;
            self.write_content(answer, out)?;
        }
        out.push_str("</tbody></table></div>\n</section>\n");
        Ok(())
    }

    /// Each media type with its schema and its examples.
    fn write_content(&self, holder: &Value, out: &mut String) -> fmt::Result {
        for (media_type, content) in fields(&holder["content"]) {
            let kind = schema::kind(&content["schema"]);
            writeln!(out, "<p><code>{}</code>: {kind}</p>", escape(media_type))?;
            let named = fields(&content["examples"])
                .map(|(name, example)| (name, &self.resolve(example)["value"]));
            let lone = content.get("example").map(|example| ("example", example));
            for (name, example) in named.chain(lone) {
                let example = match example {
                    Value::String(example) => example.clone(),
                    other => serde_json::to_string_pretty(other).map_err(|_| fmt::Error)?,
                };
                let (name, example) = (escape(name), escape(&example));
                writeln!(
                    out,
                    "<details><summary>{name}</summary><pre>{example}</pre></details>"
                )?;
            }
        }
        Ok(())
    }

    /// An example call on a command line, with the shortest body in the description; a file, where there is none.
    fn curl(&self, operation: &Operation) -> String {
        let method = match operation.method.as_str() {
            "GET" => String::new(),
            other => format!("-X {other} "),
        };
        let content = &self.resolve(&operation.about["requestBody"])["content"];
        let body = fields(content).next().map(|(media_type, content)| {
            let several = fields(&content["examples"]).map(|(_, example)| &example["value"]);
            let bodies = several.chain(content.get("example")).map(Value::to_string);
            let data = bodies.min_by_key(String::len).map_or_else(
                || "--data-binary @FILE".to_owned(),
                |shortest| format!("-d '{}'", shortest.replace('\'', r"'\''")),
            );
            format!(" \\\n  -H 'content-type: {media_type}' \\\n  {data}")
        });
        let url = operation.url();
        format!("curl {method}\"{url}\"{}", body.unwrap_or_default())
    }

    /// Resolve a reference within the description.
    fn resolve(&self, node: &'a Value) -> &'a Value {
        let pointer = node["$ref"]
            .as_str()
            .and_then(|reference| reference.strip_prefix('#'));
        pointer
            .and_then(|pointer| self.description.pointer(pointer))
            .unwrap_or(node)
    }
}

impl Operation<'_> {
    /// Where it is, with what its parameters require: their examples, or variables of the shell.
    fn url(&self) -> String {
        let mut url = format!("{LOCAL}{}", self.path);
        let required = self.parameters.iter();
        for parameter in required.filter(|parameter| parameter["required"] == true) {
            let name = parameter["name"].as_str().unwrap_or_default();
            let value = match &parameter["example"] {
                Value::Null => format!("${}", name.to_uppercase()),
                Value::String(example) => example.clone(),
                other => other.to_string(),
            };
            if parameter["in"] == "path" {
                url = url.replace(&format!("{{{name}}}"), &value);
            } else {
                let separator = if url.contains('?') { '&' } else { '?' };
                url.extend([separator.to_string(), format!("{name}={value}")]);
            }
        }
        url
    }

    fn has(&self, tag: &Value) -> bool {
        list(&self.about["tags"]).any(|known| *known == tag["name"])
    }
}

fn write_contents(operations: &[Operation], out: &mut String) -> fmt::Result {
    out.push_str("<nav aria-label=\"Contents\"><ul>\n");
    for operation in operations {
        writeln!(
            out,
            "<li><a href=\"#{}\"><span class=\"method\">{}</span> <code>{}</code></a>",
            text(&operation.about["operationId"]),
            operation.method,
            escape(operation.path)
        )?;
    }
    out.push_str("<li><a href=\"#schemas\">Schemas</a>\n</ul></nav>\n");
    Ok(())
}

fn write_parameters(parameters: &[&Value], out: &mut String) -> fmt::Result {
    if parameters.is_empty() {
        return Ok(());
    }
    out.push_str("<h4>Parameters</h4>\n<div class=\"scroll\"><table><thead><tr><th>Name<th>In<th>Type<th>Meaning</thead><tbody>\n");
    for parameter in parameters {
        let must = if parameter["required"] == true {
            " <span class=\"faint\">required</span>"
        } else {
            ""
        };
        writeln!(
            out,
            "<tr><td><code>{}</code>{must}<td>{}<td>{}<td>{}{}",
            text(&parameter["name"]),
            text(&parameter["in"]),
            schema::kind(&parameter["schema"]),
            markdown::html(parameter["description"].as_str().unwrap_or_default()),
            schema::meaning(&parameter["schema"])
        )?;
    }
    out.push_str("</tbody></table></div>\n");
    Ok(())
}

/// A string of the description, as HTML.
fn text(node: &Value) -> String {
    escape(node.as_str().unwrap_or_default())
}

fn list(node: &Value) -> impl Iterator<Item = &Value> {
    node.as_array().into_iter().flatten()
}

fn fields(node: &Value) -> impl Iterator<Item = (&str, &Value)> {
    node.as_object()
        .into_iter()
        .flatten()
        .map(|(name, value)| (name.as_str(), value))
}
