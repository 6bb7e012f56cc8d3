# belt_sim in a container:  docker build -t belt-sim .  and then
#   mkdir -p outputs && docker run --rm --user "$(id -u):$(id -g)" -v "$PWD/outputs:/belt/outputs" belt-sim demo
FROM python:3.12-slim AS wheel
WORKDIR /src
COPY pyproject.toml README.md LICENSE ./
COPY belt_sim belt_sim
COPY conf conf
COPY models models
RUN pip wheel --no-cache-dir --no-deps -w /dist .

FROM python:3.12-slim
COPY constraints.txt /tmp/constraints.txt
RUN --mount=type=bind,from=wheel,source=/dist,target=/dist pip install --no-cache-dir -c /tmp/constraints.txt /dist/*.whl
# any user may run it: nothing but /belt and the caches in HOME is written
RUN mkdir -m 1777 /belt
ENV HOME=/tmp
USER 1000:1000
WORKDIR /belt
ENTRYPOINT ["belt-sim"]
CMD ["--help"]
