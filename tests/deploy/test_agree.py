"""The files agree with the program, the Dockerfile and one another."""

import json
import re
import subprocess
import unittest

import promql_parser
import yaml

from files import (
    COMPOSE,
    DEPLOY,
    DOCKERFILE,
    IMAGE_HEALTHCHECK,
    IMAGE_PORT,
    IMAGE_USER,
    NATS_SERVER,
    NOCTULE,
    NODES,
    RESOURCES,
    ROOT,
    of_kind,
    pods,
    read,
)

HELP = subprocess.run([NOCTULE, "serve", "--help"], capture_output=True, text=True, check=True).stdout
FLAGS = set(re.findall(r"--[a-z][a-z-]*", HELP))
# Keys are not a setting: they may be in a file of their own.
VARIABLES = set(re.findall(r"NOCTULE_[A-Z_]+", HELP)) | {"NOCTULE_KEYS"}
ROUTES = set(yaml.safe_load((ROOT / "openapi.yaml").read_text())["paths"])
SERVICES = COMPOSE["services"]


def selects(selector, labels):
    return selector.items() <= labels.items()


def ports_of(pod):
    return {
        port["name"]: port["containerPort"]
        for container in pod["spec"]["containers"]
        for port in container.get("ports", [])
    }


class Nodes(unittest.TestCase):
    def test_both_deployments_have_nodes_of_each_role(self):
        self.assertEqual(len(NODES), 4, NODES)
        roles = sorted(node.settings()["role"][0] for node in NODES)
        self.assertEqual(roles, ["api", "api", "worker", "worker"])

    def test_the_program_knows_every_flag_and_variable(self):
        for node in NODES:
            self.assertEqual(node.arguments[0], "serve")
            flags = {word.split("=")[0] for word in node.arguments if word.startswith("--")}
            self.assertLessEqual(flags, FLAGS, node.name)
            own = {name for name in node.variables if name.startswith("NOCTULE_")}
            self.assertLessEqual(own, VARIABLES, node.name)
        named = set(re.findall(r"NOCTULE_[A-Z_]+", (DEPLOY / "kubernetes/api.yaml").read_text()))
        self.assertLessEqual(named, VARIABLES)

    def test_each_setting_comes_from_the_file(self):
        for node in NODES:
            settings = node.settings()
            for name, value in node.variables.items():
                shown, source = settings[name.removeprefix("NOCTULE_").lower()]
                self.assertEqual(source, name, node.name)
                self.assertIn(shown, {value, value.removesuffix("s")}, node.name)
            for word in node.arguments[1:]:
                if word.startswith("--") and "=" in word:
                    flag, value = word.split("=")
                    key = flag.removeprefix("--").replace("-", "_")
                    self.assertEqual(settings[key], (value, flag), node.name)

    def test_nodes_that_share_a_store_agree_on_its_settings(self):
        for prefix in ("compose ", "noctule-"):
            nodes = [node.settings() for node in NODES if node.name.startswith(prefix)]
            self.assertEqual(len(nodes), 2)
            for key in ("store", "store_replicas", "store_lease", "queue"):
                self.assertEqual(nodes[0][key], nodes[1][key])

    def test_nodes_listen_on_the_expected_port(self):
        for node in NODES:
            settings = node.settings()
            self.assertEqual(settings["listen"][0], f"0.0.0.0:{IMAGE_PORT}", node.name)
            self.assertEqual(settings["data_dir"][0], "/data", node.name)

    def test_nodes_have_enough_time_to_stop(self):
        for node in NODES:
            grace_s = float(node.settings()["grace"][0])
            self.assertGreaterEqual(node.patience_s, node.before_s + grace_s + 5, node.name)

    def test_a_store_has_one_replica_per_server(self):
        servers = {"compose ": 1, "noctule-": of_kind("StatefulSet")[0]["spec"]["replicas"]}
        for node in NODES:
            most = servers[node.name[:8]]
            settings = node.settings()
            self.assertEqual(int(settings["store_replicas"][0]), most, node.name)
            hosts = settings["store"][0].removeprefix("nats://").split("/")[0].split(",")
            self.assertEqual(len(hosts), most, node.name)


class Compose(unittest.TestCase):
    def test_everything_named_exists(self):
        volumes = set(COMPOSE["volumes"])
        for name, service in SERVICES.items():
            for other in service.get("depends_on", {}):
                self.assertIn(other, SERVICES)
            for volume in service.get("volumes", []):
                source = volume.split(":")[0]
                if source.startswith("."):
                    self.assertTrue((DEPLOY / source).exists(), f"{name}: {source}")
                elif not source.startswith("/"):
                    self.assertIn(source, volumes)
        self.assertTrue((DEPLOY / SERVICES["api"]["build"]["context"] / "Dockerfile").exists())

    def test_health_dependencies_have_a_healthcheck(self):
        for service in SERVICES.values():
            for other, how in service.get("depends_on", {}).items():
                if how["condition"] == "service_healthy":
                    self.assertIn("healthcheck", SERVICES[other])

    def test_no_service_can_write_to_its_image_or_gain_rights(self):
        for name, service in SERVICES.items():
            self.assertTrue(service["read_only"], name)
            self.assertEqual(service["cap_drop"], ["ALL"], name)
            self.assertIn("no-new-privileges:true", service["security_opt"], name)

    def test_ports_are_published_on_loopback_only(self):
        for service in SERVICES.values():
            for port in service.get("ports", []):
                self.assertTrue(port.startswith("127.0.0.1:"), port)
        self.assertTrue(SERVICES["api"]["ports"][0].endswith(f":{IMAGE_PORT}"))

    def test_the_healthcheck_is_that_of_the_image(self):
        for name in ("api", "worker"):
            self.assertEqual(SERVICES[name]["healthcheck"]["test"], ["CMD", *IMAGE_HEALTHCHECK])

    def test_the_servers_are_addressed_where_they_listen(self):
        config = (DEPLOY / "nats/nats.conf").read_text()
        port = re.search(r'listen: "0.0.0.0:(\d+)"', config)[1]
        monitor = re.search(r'http: "0.0.0.0:(\d+)"', config)[1]
        for node in NODES[:2]:
            self.assertTrue(node.variables["NOCTULE_STORE"].startswith(f"nats://nats:{port}/"))
        self.assertIn(f"http://nats:{monitor}", SERVICES["nats-exporter"]["command"])
        self.assertIn(f":{monitor}/", SERVICES["nats"]["healthcheck"]["test"][-1])


class Prometheus(unittest.TestCase):
    def test_every_scrape_target_exists(self):
        [config] = read("prometheus/compose.yml")
        looked_for = {}
        for job in config["scrape_configs"]:
            self.assertIn(job.get("metrics_path", "/metrics"), ROUTES)
            for found in job.get("dns_sd_configs", []):
                looked_for |= dict.fromkeys(found["names"], found["port"])
            for found in job.get("static_configs", []):
                looked_for |= {target.split(":")[0]: int(target.split(":")[1]) for target in found["targets"]}
        exporter = [word for word in SERVICES["nats-exporter"]["command"] if word.startswith("-port=")]
        exporter_port = int(exporter[0].removeprefix("-port="))
        self.assertEqual(looked_for, {"api": IMAGE_PORT, "worker": IMAGE_PORT, "nats-exporter": exporter_port})

    def test_configuration_files_are_mounted_where_they_are_read(self):
        mounted = {volume.split(":")[1]: volume.split(":")[0] for volume in SERVICES["prometheus"]["volumes"]}
        config = SERVICES["prometheus"]["command"][0].removeprefix("--config.file=")
        self.assertEqual(mounted[config], "./prometheus/compose.yml")
        for rules in read("prometheus/compose.yml")[0]["rule_files"]:
            self.assertIn(f"/etc/prometheus/{rules}", mounted)

    def test_every_query_parses(self):
        asked = [rule["expr"] for group in read("prometheus/alerts.yml")[0]["groups"] for rule in group["rules"]]
        dashboard = json.loads((DEPLOY / "grafana/noctule.json").read_text())
        for panel in dashboard["panels"]:
            asked += [target["expr"] for target in panel.get("targets", [])]
        [rule] = read("kubernetes/queue-metric.yaml")[0]["rules"]["external"]
        asked += [rule["seriesQuery"], rule["metricsQuery"].replace("<<.LabelMatchers>>", 'namespace="a"')]
        self.assertGreater(len(asked), 30)
        for expression in asked:
            known = expression.replace("$__rate_interval", "1m").replace("$__range", "1h")
            promql_parser.parse(known)

    def test_grafana_finds_its_data_source_and_dashboard(self):
        [source] = read("grafana/provisioning/datasources/prometheus.yml")[0]["datasources"]
        host, port = source["url"].removeprefix("http://").split(":")
        self.assertIn(f":{port}/", SERVICES[host]["healthcheck"]["test"][-1])
        [provider] = read("grafana/provisioning/dashboards/noctule.yml")[0]["providers"]
        mounted = [volume.split(":")[1] for volume in SERVICES["grafana"]["volumes"]]
        self.assertIn(provider["options"]["path"] + "/noctule.json", mounted)
        self.assertIn(SERVICES["grafana"]["environment"]["GF_DASHBOARDS_DEFAULT_HOME_DASHBOARD_PATH"], mounted)


class Kubernetes(unittest.TestCase):
    def test_the_kustomization_lists_every_file(self):
        [kustomization] = read("kubernetes/kustomization.yaml")
        files = {path.name for path in (DEPLOY / "kubernetes").glob("*.yaml")}
        self.assertEqual(files - set(kustomization["resources"]), {"kustomization.yaml", "queue-metric.yaml"})
        self.assertEqual(of_kind("Namespace")[0]["metadata"]["name"], kustomization["namespace"])
        [image] = kustomization["images"]
        self.assertEqual(image["name"], re.search(r"docker build -t (\S+)", DOCKERFILE)[1])
        version = re.search(r'^version = "(.*)"', (ROOT / "Cargo.toml").read_text(), re.MULTILINE)[1]
        self.assertEqual(image["newTag"], version)

    def test_probes_use_existing_routes_and_ports(self):
        for workload, pod in pods():
            for container in pod["spec"]["containers"]:
                for kind in ("startupProbe", "livenessProbe", "readinessProbe"):
                    if container["name"] == "exporter":
                        continue
                    get = container[kind]["httpGet"]
                    self.assertIn(get["port"], ports_of(pod), workload["metadata"]["name"])
                    if container["image"] == "noctule":
                        self.assertIn(get["path"], ROUTES)

    def test_ports_agree(self):
        for workload, pod in pods():
            ports = ports_of(pod)
            name = workload["metadata"]["name"]
            if name != "nats":
                self.assertEqual(ports, {"http": IMAGE_PORT})
            annotations = pod["metadata"]["annotations"]
            self.assertIn(int(annotations["prometheus.io/port"]), ports.values(), name)
            self.assertIn(annotations["prometheus.io/path"], ROUTES)
        for service in of_kind("Service"):
            selected = [pod for _, pod in pods() if selects(service["spec"]["selector"], pod["metadata"]["labels"])]
            self.assertEqual(len(selected), 1, service["metadata"]["name"])
            for port in service["spec"]["ports"]:
                self.assertIn(port["targetPort"], ports_of(selected[0]))

    def test_every_selector_selects_something(self):
        for workload, pod in pods():
            self.assertTrue(selects(workload["spec"]["selector"]["matchLabels"], pod["metadata"]["labels"]))
        for budget in of_kind("PodDisruptionBudget"):
            selector = budget["spec"]["selector"]["matchLabels"]
            selected = [w for w, pod in pods() if selects(selector, pod["metadata"]["labels"])]
            self.assertEqual([w["metadata"]["name"] for w in selected], [budget["metadata"]["name"]])
        for policy in of_kind("NetworkPolicy"):
            selector = policy["spec"]["podSelector"].get("matchLabels", {})
            selected = [pod for _, pod in pods() if selects(selector, pod["metadata"]["labels"])]
            self.assertTrue(selected, policy["metadata"]["name"])
            for rule in policy["spec"].get("ingress", []):
                for port in rule["ports"]:
                    self.assertIn(port["port"], ports_of(selected[0]), policy["metadata"]["name"])

    def test_autoscalers_name_existing_workloads_and_metrics(self):
        [rule] = read("kubernetes/queue-metric.yaml")[0]["rules"]["external"]
        workloads = {workload["metadata"]["name"]: workload for workload, _ in pods()}
        for autoscaler in of_kind("HorizontalPodAutoscaler"):
            target = workloads[autoscaler["spec"]["scaleTargetRef"]["name"]]
            self.assertNotIn("replicas", target["spec"], "both would say how many")
            for metric in autoscaler["spec"]["metrics"]:
                if metric["type"] == "External":
                    self.assertEqual(metric["external"]["metric"]["name"], rule["name"]["as"])

    def test_a_worker_runs_as_many_plans_as_it_has_cpus(self):
        [pod] = [pod for workload, pod in pods() if workload["metadata"]["name"] == "noctule-worker"]
        [container, *_] = pod["spec"]["containers"]
        self.assertIn(f"--workers={container['resources']['limits']['cpu']}", container["args"])

    def test_no_container_is_root_or_writes_to_its_image(self):
        for workload, pod in pods():
            name = workload["metadata"]["name"]
            self.assertTrue(pod["spec"]["securityContext"]["runAsNonRoot"], name)
            self.assertFalse(pod["spec"]["automountServiceAccountToken"], name)
            for container in pod["spec"]["containers"]:
                context = container["securityContext"]
                self.assertTrue(context["readOnlyRootFilesystem"], name)
                self.assertFalse(context["allowPrivilegeEscalation"], name)
                self.assertEqual(context["capabilities"], {"drop": ["ALL"]}, name)
                self.assertIn("memory", container["resources"]["limits"], name)
                if container["image"] == "noctule":
                    self.assertEqual(pod["spec"]["securityContext"]["runAsUser"], IMAGE_USER)

    def test_servers_and_nodes_address_the_servers_correctly(self):
        [servers] = of_kind("StatefulSet")
        name, service = servers["metadata"]["name"], servers["spec"]["serviceName"]
        self.assertIn(service, [resource["metadata"]["name"] for resource in of_kind("Service")])
        names = [f"{name}-{number}.{service}" for number in range(servers["spec"]["replicas"])]
        ports = ports_of(servers["spec"]["template"])
        [config] = [r["data"]["nats.conf"] for r in of_kind("ConfigMap") if "nats.conf" in r["data"]]
        for server in names:
            self.assertIn(f"nats://{server}:{ports['cluster']}", config)
        hosts = ",".join(f"{server}:{ports['client']}" for server in names)
        for node in NODES[2:]:
            self.assertTrue(node.variables["NOCTULE_STORE"].startswith(f"nats://{hosts}/"))
        for port in ("client", "cluster", "monitor"):
            self.assertIn(f'"0.0.0.0:{ports[port]}"', config)
        # The size limit of the stored files, and the size of a volume.
        kept = int(re.search(r"max_file_store: (\d+)GB", config)[1])
        claimed = servers["spec"]["volumeClaimTemplates"][0]["spec"]["resources"]["requests"]["storage"]
        self.assertLess(kept, int(claimed.removesuffix("Gi")))

    def test_resource_names_are_unique(self):
        names = [(resource["kind"], resource["metadata"]["name"]) for resource in RESOURCES]
        self.assertEqual(len(names), len(set(names)))


class NatsServer(unittest.TestCase):
    def test_the_configuration_is_valid(self):
        [of_pods] = [r["data"]["nats.conf"] for r in of_kind("ConfigMap") if "nats.conf" in r["data"]]
        for config in (of_pods, (DEPLOY / "nats/nats.conf").read_text()):
            self.assertIn("sync_interval: always", config)
            checked = subprocess.run(
                [NATS_SERVER, "-t", "-c", "/dev/stdin"],
                input=config,
                env={"SERVER_NAME": "nats-0"},
                capture_output=True,
                text=True,
                check=False,
            )
            self.assertEqual(checked.returncode, 0, checked.stderr)


if __name__ == "__main__":
    unittest.main()
