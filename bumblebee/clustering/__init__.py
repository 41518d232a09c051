"""Text-motion clustering (paper, section "AE Clustering"): features, autoencoder, K-means, audit."""
