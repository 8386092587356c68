# gapbeam in a container: docker build -t gapbeam .
# The layers change ever more often: Debian's packages, PyPI's, gapbeam.
ARG BASE=docker.io/library/debian:trixie-slim
FROM ${BASE}

# dpkg takes the files in the order of their names, and the last line that matches holds; the browser that prints PDFs
# is a layer of its own (environment/container/Dockerfile.pdf)
COPY environment/dpkg.cfg /etc/dpkg/dpkg.cfg.d/gapbeam
COPY environment/container/dpkg.cfg /etc/dpkg/dpkg.cfg.d/gapbeam-image
COPY environment/packages.txt environment/container/slim.py /usr/share/gapbeam/
RUN apt-get update \
 && sed 's/#.*//; /^chromium/d' /usr/share/gapbeam/packages.txt \
  | DEBIAN_FRONTEND=noninteractive xargs apt-get install -y --no-install-recommends tini \
 && python3 /usr/share/gapbeam/slim.py debian /usr/lib/python3/dist-packages \
 && apt-get clean && rm -rf /var/lib/apt/lists/*

# for a PyPI mirror or a proxy with a certificate of its own: --build-arg
ARG PIP_INDEX_URL
ARG PIP_CERT
COPY environment/requirements.txt /usr/share/gapbeam/
RUN python3 -m venv --system-site-packages /opt/gapbeam \
 && /opt/gapbeam/bin/pip install --no-cache-dir -r /usr/share/gapbeam/requirements.txt \
 && /opt/gapbeam/bin/python /usr/share/gapbeam/slim.py venv /opt/gapbeam/lib/python3.*/site-packages \
 && rm -rf /opt/gapbeam/share/jupyter

# one thread a rank; Open MPI on fewer cores than ranks; pictures without a screen; any --user may run it
ENV PATH=/opt/gapbeam/bin:$PATH \
    HOME=/home/gapbeam \
    USER=gapbeam \
    OMP_NUM_THREADS=1 \
    OPENBLAS_NUM_THREADS=1 \
    OMPI_MCA_btl=^tcp \
    PRTE_MCA_rmaps_default_mapping_policy=:oversubscribe \
    PRTE_MCA_hwloc_default_binding_policy=none \
    PYVISTA_OFF_SCREEN=true \
    VTK_DEFAULT_OPENGL_WINDOW=vtkEGLRenderWindow
RUN useradd --create-home gapbeam && install -d -m 1777 /home/gapbeam /home/gapbeam/results

COPY . /usr/src/gapbeam
RUN /opt/gapbeam/bin/pip install --no-cache-dir --no-deps --no-build-isolation /usr/src/gapbeam \
 && ln -s /usr/src/gapbeam/gapbeam/cases /home/gapbeam/cases \
 && rm -rf /usr/src/gapbeam/build /usr/src/gapbeam/*.egg-info

USER gapbeam
WORKDIR /home/gapbeam
# what first runs would wait for, on processors like the one that builds the image; any --user may add to it
RUN gapbeam compile && chmod -R a+rwX /home/gapbeam/.cache
# the first process of a container hears no signal that it does not ask for: tini is that, and passes them on
ENTRYPOINT ["/usr/bin/tini", "--", "gapbeam"]
CMD ["--help"]
