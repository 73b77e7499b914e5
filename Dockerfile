# One image for every service: the programs share their packages, and only the command differs.
ARG PYTHON=3.11.14-slim-bookworm

FROM python:${PYTHON} AS build
ENV PIP_DISABLE_PIP_VERSION_CHECK=1 UV_LINK_MODE=copy UV_COMPILE_BYTECODE=1
WORKDIR /build
# hadolint ignore=DL3008
RUN apt-get update && apt-get install --no-install-recommends --yes binutils
RUN pip install --no-cache-dir uv==0.13.8 && uv venv /opt/shoal/venv
COPY requirements.lock pyproject.toml ./
# The locked versions of what runs here; the tools of development stay outside.
RUN VIRTUAL_ENV=/opt/shoal/venv uv pip install --no-cache --constraints requirements.lock --requirements pyproject.toml \
    --extra engines --extra pipeline --extra services --extra deploy --extra scale
COPY README.md LICENSE ./
COPY services services
COPY flows flows
COPY validation validation
COPY deploy/slim.py deploy/slim.py
RUN VIRTUAL_ENV=/opt/shoal/venv uv pip install --no-cache --no-deps --build-constraints requirements.lock . \
    && python deploy/slim.py /opt/shoal/venv/lib/python3.11/site-packages

# Exudyn is linked against a viewer, even where nothing is shown. These three pass calls on to drivers, which stay here.
FROM python:${PYTHON} AS viewer
# hadolint ignore=DL3008
RUN apt-get update && apt-get install --no-install-recommends --yes libgl1 \
    && mkdir /viewer && cp -L /usr/lib/*-linux-gnu/libGL.so.1 /usr/lib/*-linux-gnu/libGLX.so.0 \
       /usr/lib/*-linux-gnu/libGLdispatch.so.0 /viewer

FROM python:${PYTHON} AS runtime
COPY --from=viewer /viewer/ /usr/local/lib/
# hadolint ignore=DL3008
RUN apt-get update \
    && apt-get install --no-install-recommends --yes libx11-6 && ldconfig \
    && rm -rf /var/lib/apt/lists/* \
    && groupadd --gid 10001 shoal \
    && useradd --uid 10001 --gid shoal --no-create-home --home-dir /var/lib/shoal --shell /usr/sbin/nologin shoal \
    && install -d -o shoal -g shoal /var/lib/shoal /var/lib/mlflow /var/lib/prefect /var/lib/kernels /var/lib/library
COPY --from=build /opt/shoal/venv /opt/shoal/venv
COPY --chmod=755 deploy/entrypoint.sh /opt/shoal/entrypoint.sh
COPY --chmod=644 prefect.yaml /opt/shoal/prefect.yaml
ENV PATH=/opt/shoal/venv/bin:${PATH} \
    PYTHONUNBUFFERED=1 \
    PYTHONDONTWRITEBYTECODE=1 \
    OPENBLAS_NUM_THREADS=1 \
    SHOAL_HOME=/var/lib/shoal \
    SHOAL_LIBRARY=/var/lib/library \
    NUMBA_CACHE_DIR=/tmp/kernels \
    MPLCONFIGDIR=/tmp/matplotlib
# Machine code for the processor that builds the image; on another kind each kernel is compiled when first used.
RUN NUMBA_CACHE_DIR=/opt/shoal/kernels SHOAL_HOME=/tmp/home MPLCONFIGDIR=/tmp/home \
    python -m shoal.mechanics.warm && rm -rf /tmp/home \
    && find /opt/shoal/kernels -type f -exec sha256sum {} + > /tmp/files && sha256sum /tmp/files > /tmp/all \
    && cut -c 1-16 /tmp/all > /opt/shoal/kernels.version && rm /tmp/files /tmp/all
ARG REVISION=""
ENV SHOAL_REVISION=${REVISION}
WORKDIR /opt/shoal
USER 10001:10001
ENTRYPOINT ["/opt/shoal/entrypoint.sh"]
CMD ["shoal", "--help"]
