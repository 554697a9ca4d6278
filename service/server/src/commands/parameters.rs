//! `meetpoint parameters`: what readings of a map's sensors are taken to mean.

use anyhow::Context as _;
use meetpoint_proto::v1;
use serde_json::Value;

use super::asked::ServerArgs;
use crate::rest::{MappingParameters, MappingParametersState};

/// Options of `meetpoint parameters`.
#[derive(Debug, clap::Args)]
pub struct ParametersArgs {
    /// The map
    map: String,
    /// Another value for one of them; more than one may be given. Those that are not named stay
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = setting)]
    settings: Vec<(String, f64)>,
    /// All as the service has them for buildings, but for those that are set beside
    #[arg(long)]
    reset: bool,
    #[command(flatten)]
    server: ServerArgs,
}

/// Tells the parameters of a map, after changing them if that is asked for.
///
/// # Errors
/// If there is no such map or parameter, or a value is out of its range.
pub async fn run(args: ParametersArgs) -> anyhow::Result<()> {
    let ParametersArgs { map, settings, reset, server } = args;
    let client = server.client()?;
    let mut state = client.mapping_parameters(&map).await?;
    if reset || !settings.is_empty() {
        let before = state.parameters.filter(|_| !reset).unwrap_or_default();
        state = client.set_mapping_parameters(&map, changed(before, settings)?).await?;
    }
    if server.json {
        println!("{}", serde_json::to_string(&MappingParametersState::from(state))?);
        return Ok(());
    }
    let values =
        serde_json::to_value(MappingParameters::from(state.parameters.unwrap_or_default()));
    for (name, value) in values?.as_object().into_iter().flatten() {
        println!("{name} = {value}");
    }
    let name = if state.name.is_empty() { "the service's own" } else { &state.name };
    let drawn = match (state.map_version, state.drawn) {
        (0, _) => "nothing is drawn yet".to_owned(),
        (version, true) => format!("version {version} is drawn by them"),
        (version, false) => {
            format!("version {version} is drawn by others: meetpoint rebuild --map {map}")
        }
    };
    println!("map {map}: {name}; {drawn}");
    Ok(())
}

/// Parameters with some of them changed, by their names on the wire.
fn changed(
    before: v1::MappingParameters,
    settings: Vec<(String, f64)>,
) -> anyhow::Result<v1::MappingParameters> {
    let mut values = serde_json::to_value(MappingParameters::from(before))?;
    let names = values.as_object_mut().context("parameters are an object")?;
    for (name, value) in settings {
        let known = || names.keys().cloned().collect::<Vec<_>>().join(", ");
        anyhow::ensure!(names.contains_key(&name), "no parameter `{name}`; there are {}", known());
        names.insert(name, Value::from(value));
    }
    Ok(serde_json::from_value::<MappingParameters>(values)?.into())
}

/// Reads `name=value`.
fn setting(text: &str) -> Result<(String, f64), String> {
    let (name, value) = text.split_once('=').ok_or("is not NAME=VALUE")?;
    let value = value.trim().parse().map_err(|_| format!("`{value}` is no number"))?;
    Ok((name.trim().to_owned(), value))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_is_changed_and_the_others_stay() {
        let before =
            v1::MappingParameters { prior: Some(0.5), decay: Some(1.0), ..Default::default() };
        let set = |text: &str| changed(before, vec![setting(text).expect("a setting")]);
        let expected = v1::MappingParameters { decay: Some(0.99), ..before };
        assert_eq!(set("decay = 0.99").expect("it is one"), expected, "that one");
        let refused = set("speed=3").expect_err("it is none").to_string();
        assert!(refused.starts_with("no parameter `speed`; there are decay, "), "{refused}");
        assert!(setting("decay").is_err() && setting("decay=much").is_err(), "no settings");
    }
}
