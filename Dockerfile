# belt_sim in a container:  docker build -t belt-sim .  and  docker run --rm -v "$PWD/outputs:/belt/outputs" belt-sim demo
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
RUN useradd --create-home belt && mkdir /belt && chown belt /belt
USER belt
WORKDIR /belt
ENTRYPOINT ["belt-sim"]
CMD ["--help"]
