// What a program against the types that openapi-typescript makes would write. It must compile under `strict`.

import assert from "node:assert/strict";
import test from "node:test";

import createClient from "openapi-fetch";

import type { components, paths } from "./noctule";

type Schemas = components["schemas"];

const client = createClient<paths>({ baseUrl: process.env.NOCTULE_URL });
const least: Schemas["Scenario"] = {
    start: { x: 0, y: 0, z: 50 },
    target: { x: 1000, y: 0, z: 50 },
    altitude: { min: 0, max: 100 },
};
const planner: Schemas["Planner"] = {
    waypoints: 3, population: 20, iterations: 20, parameters: { quadrature: "paper", f_max: 1.5 },
};

async function plan(scenario: Schemas["Scenario"]): Promise<Schemas["StatusDocument"]> {
    const { data, error } = await client.POST("/plans", {
        body: scenario, params: { header: { Prefer: "wait=30" } },
    });
    assert.ok(data && "id" in data, JSON.stringify(error));
    return data;
}

test("a plan and its route", async () => {
    const threats: Schemas["Cylinder"][] = [{ kind: "cylinder", center: { x: 400, y: 10 }, radius: 50 }];
    const { id, status } = await plan({ ...least, threats, planner });
    assert.equal(status, "succeeded");

    const { data } = await client.GET("/plans/{id}/result", { params: { path: { id } } });
    const result = data as Schemas["ResultDocument"];
    const last = result.waypoints.at(-1);
    assert.ok(last && "x" in last && last.x === 1000);
    const csv = await client.GET("/plans/{id}/result", {
        params: { path: { id }, query: { format: "csv" } }, parseAs: "text",
    });
    assert.match(csv.data as string, /\n/);

    // The accepted document, changed and posted again.
    const { data: accepted } = await client.GET("/plans/{id}/scenario", { params: { path: { id } } });
    assert.ok(accepted);
    const again = await plan({ ...accepted, planner: { ...planner, warm_start: { plan_id: id } } });
    assert.equal(again.status, "succeeded");
});

test("events are told apart by their names", async () => {
    const { id } = await plan({ ...least, planner });
    const { data } = await client.GET("/plans/{id}/events", {
        params: { path: { id }, query: { rate: 0 } },
        headers: { accept: "application/x-ndjson" },
        parseAs: "text",
    });
    const seen = new Set<string>();
    for (const line of (data as unknown as string).split("\n").filter(Boolean)) {
        const event = JSON.parse(line) as Schemas["EventLine"];
        seen.add(event.event);
        switch (event.event) {
            case "status": assert.ok(event.data.status); break;
            case "convergence": assert.ok(event.data.evaluations > 0); break;
            case "incumbent": assert.equal(event.data.waypoints.length, 5); break;
            case "gap": assert.ok(event.data.to >= event.data.from); break;
            case "end": assert.equal(event.data.status, "succeeded"); break;
        }
    }
    assert.ok(["status", "convergence", "incumbent", "end"].every((name) => seen.has(name)), [...seen].join());
    // @ts-expect-error: a rate is a number
    const wrong: paths["/plans/{id}/events"]["get"]["parameters"]["query"] = { rate: "fast" };
    assert.ok(wrong);
});

test("a conversion can be edited and posted", async () => {
    const place = (name: string, coordinates: number[]) => (
        { type: "Feature", properties: { name }, geometry: { type: "Point", coordinates } }
    );
    const features = [place("start", [8.5456, 47.3977, 540]), place("target", [8.5623, 47.405, 580])];
    const { data } = await client.POST("/scenarios:convert", { body: { type: "FeatureCollection", features } });
    assert.ok(data);
    const scenario = { ...data.scenario, planner } as Schemas["Scenario"];
    assert.equal((await plan(scenario)).status, "succeeded");
});

test("a refusal lists its faults", async () => {
    const { error } = await client.POST("/plans", { body: { ...least, altitude: { min: 50, max: 20 } } });
    assert.ok(error);
    assert.equal(error.errors?.[0]?.pointer, "/altitude");
});
